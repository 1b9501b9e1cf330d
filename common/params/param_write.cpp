#include <charconv>
#include <cmath>

#include "common/base/check.h"
#include "common/params/param_tree.h"

namespace archetide {
namespace {

using Kind = ParamNode::Kind;

std::string quoted(const std::string& text) {
  static const char* const kHex = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\', out += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      out += "\\u00", out += kHex[byte >> 4], out += kHex[byte & 15];
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string key_text(const std::string& key) {
  const bool bare = !key.empty() && key.find_first_not_of(
                                        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                        "0123456789_-") == std::string::npos;
  return bare ? key : quoted(key);
}

// Shortest text that reads back to the same double; a TOML float needs a point or an exponent.
std::string number_text(double x) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof(buffer), x).ptr;
  std::string text(buffer, end);
  const bool whole = std::isfinite(x) && text.find_first_of(".e") == std::string::npos;
  return whole ? text + ".0" : text;
}

std::string inline_text(const ParamNode& node);

std::string inline_list(const ParamNode& node) {
  std::string text;
  for (const ParamNode& item : node.items) text += (text.empty() ? "" : ", ") + inline_text(item);
  return "[" + text + "]";
}

std::string inline_table(const ParamNode& node) {
  std::string text;
  for (const auto& [key, value] : node.entries) {
    text += (text.empty() ? "" : ", ") + key_text(key) + " = " + inline_text(value);
  }
  return "{ " + text + " }";
}

std::string inline_text(const ParamNode& node) {
  switch (node.kind) {
    case Kind::kBool:
      return node.boolean ? "true" : "false";
    case Kind::kInteger:
      return std::to_string(node.integer);
    case Kind::kNumber:
      return number_text(node.number);
    case Kind::kString:
      return quoted(node.string);
    case Kind::kArray:
      return inline_list(node);
    case Kind::kTable:
      return inline_table(node);
    case Kind::kDate:
      break;
  }
  throw AssertionError("no schema allows dates");
}

std::string lines(const ParamNode& table) {
  std::string text;
  for (const auto& [key, value] : table.entries) {
    text += key_text(key) + " = " + inline_text(value) + "\n";
  }
  return text;
}

}  // namespace

std::string to_toml(const ParamNode& root) {
  // Plain keys first: after a [section] they would belong to it.
  std::string plain, sections;
  for (const auto& [key, value] : root.entries) {
    if (value.kind == Kind::kTable) {
      sections += "\n[" + key_text(key) + "]\n" + lines(value);
    } else if (value.is_table_list()) {
      for (const ParamNode& item : value.items)
        sections += "\n[[" + key_text(key) + "]]\n" + lines(item);
    } else {
      plain += key_text(key) + " = " + inline_text(value) + "\n";
    }
  }
  return plain + sections;
}

}  // namespace archetide
