#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/params/schema.h"

namespace archetide {
namespace {

// Words that a key accepts; those refused in this version are marked.
std::string allowed_text(const Key& key) {
  std::string text = key.range.text();
  for (const std::string& choice : key.choices) text += (text.empty() ? "" : " | ") + choice;
  if (key.later.empty()) return text;
  for (const std::string& value : key.later_values) {
    text += (text.empty() ? "" : " | ") + value + " (not in this version)";
  }
  return key.later_values.empty() ? "not in this version" : text;
}

std::string escape_markdown(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

}  // namespace

std::string type_name(KeyType type) {
  switch (type) {
    case KeyType::kBool:
      return "true or false";
    case KeyType::kInteger:
      return "integer";
    case KeyType::kNumber:
      return "number";
    case KeyType::kString:
      return "string";
    case KeyType::kStrings:
      return "list of strings";
    case KeyType::kVec3:
      return "[x, y, z]";
    case KeyType::kIntVec3:
      return "[i, j, k] integers";
    case KeyType::kPoints:
      return "list of [x, y, z]";
    case KeyType::kPointsOrString:
      return "list of [x, y, z] or string";
    case KeyType::kIntegerOrString:
      return "integer or string";
    case KeyType::kVec3OrString:
      return "[x, y, z] or string";
    case KeyType::kTable:
      return "table";
    case KeyType::kTables:
      return "list of tables";
    case KeyType::kTablesOrString:
      return "list of tables or string";
  }
  return "";
}

std::string Schema::text() const {
  std::ostringstream out;
  for (const Key& key : keys_) {
    out << std::left << std::setw(30) << key.path << ' ' << std::setw(19) << type_name(key.type)
        << ' ' << std::setw(8) << key.unit << ' ' << std::setw(16) << ("= " + key.fallback) << ' ';
    const std::string allowed = allowed_text(key);
    if (!allowed.empty()) out << '{' << allowed << "} ";
    out << key.meaning << '\n';
  }
  return out.str();
}

std::string Schema::json() const {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const Key& key : keys_) {
    nlohmann::ordered_json row;
    row["path"] = key.path;
    row["type"] = type_name(key.type);
    row["unit"] = key.unit;
    row["range"] = key.range.text();
    row["choices"] = key.choices;
    row["default"] = key.fallback;
    row["meaning"] = key.meaning;
    row["later"] = key.later;
    row["later_values"] = key.later_values;
    rows.push_back(row);
  }
  return nlohmann::ordered_json{{"file", name_}, {"keys", rows}}.dump(2) + "\n";
}

std::string Schema::markdown() const {
  std::ostringstream out;
  out << "| key | type | unit | allowed | default | meaning |\n|---|---|---|---|---|---|\n";
  for (const Key& key : keys_) {
    out << "| `" << key.path << "` | " << type_name(key.type) << " | " << key.unit << " | "
        << escape_markdown(allowed_text(key)) << " | "
        << (key.fallback.empty() ? "" : "`" + key.fallback + "`") << " | "
        << escape_markdown(key.meaning) << " |\n";
  }
  return out.str();
}

}  // namespace archetide
