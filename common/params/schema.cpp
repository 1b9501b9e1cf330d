#include "common/params/schema.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "common/base/check.h"

namespace archetide {
namespace {

using Kind = ParamNode::Kind;

std::string shown_number(double x) {
  std::ostringstream stream;
  stream.precision(12);
  stream << x;
  return stream.str();
}

std::string parent_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

// "body[].modes" -> "modes", "body[]" -> "body"
std::string last_name(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  std::string name = dot == std::string::npos ? path : path.substr(dot + 1);
  return name.ends_with("[]") ? name.substr(0, name.size() - 2) : name;
}

std::string describe(const ParamNode& value) {
  switch (value.kind) {
    case Kind::kBool:
      return value.boolean ? "true" : "false";
    case Kind::kInteger:
      return std::to_string(value.integer);
    case Kind::kNumber:
      return shown_number(value.number);
    case Kind::kString:
      return "the string \"" + value.string + "\"";
    case Kind::kDate:
      return "a date or time";
    case Kind::kArray:
      return fmt::format("a list of {}", value.items.size());
    case Kind::kTable:
      break;
  }
  return "a table";
}

std::string choices_text(const std::vector<std::string>& choices) {
  std::string text;
  for (const std::string& choice : choices) text += (text.empty() ? "\"" : ", \"") + choice + "\"";
  return text;
}

// What the key expects, for the hint below an error.
std::string wanted(const Key& key) {
  std::string text = "expected " + type_name(key.type);
  if (!key.unit.empty()) text += " in " + key.unit;
  if (!key.range.text().empty()) text += ", " + key.range.text();
  if (!key.choices.empty()) text += ", one of " + choices_text(key.choices);
  if (!key.meaning.empty()) text += ": " + key.meaning;
  return text;
}

bool is_integer(const ParamNode& v) { return v.kind == Kind::kInteger; }
bool is_string(const ParamNode& v) { return v.kind == Kind::kString; }
bool is_number(const ParamNode& v) {
  return v.kind == Kind::kNumber || is_integer(v) || (is_string(v) && !std::isnan(number_of(v)));
}
bool is_list_of(const ParamNode& v, bool (*test)(const ParamNode&)) {
  return v.kind == Kind::kArray && std::all_of(v.items.begin(), v.items.end(), test);
}
bool is_vec3(const ParamNode& v) { return is_list_of(v, is_number) && v.items.size() == 3; }
bool is_int_vec3(const ParamNode& v) { return is_list_of(v, is_integer) && v.items.size() == 3; }

bool has_type(const ParamNode& v, KeyType type) {
  switch (type) {
    case KeyType::kBool:
      return v.kind == Kind::kBool;
    case KeyType::kInteger:
      return is_integer(v);
    case KeyType::kNumber:
      return is_number(v);
    case KeyType::kString:
      return is_string(v);
    case KeyType::kStrings:
      return is_list_of(v, is_string);
    case KeyType::kVec3:
      return is_vec3(v);
    case KeyType::kIntVec3:
      return is_int_vec3(v);
    case KeyType::kPoints:
      return is_list_of(v, is_vec3);
    case KeyType::kPointsOrString:
      return is_string(v) || is_list_of(v, is_vec3);
    case KeyType::kIntegerOrString:
      return is_integer(v) || is_string(v);
    case KeyType::kVec3OrString:
      return is_vec3(v) || is_string(v);
    case KeyType::kTable:
      return v.kind == Kind::kTable;
    case KeyType::kTables:
      return v.is_table_list() || (v.kind == Kind::kArray && v.items.empty());
    case KeyType::kTablesOrString:
      return is_string(v) || has_type(v, KeyType::kTables);
  }
  return false;
}

// The scalars inside a value, vectors and lists taken apart.
void collect_scalars(const ParamNode& v, std::vector<const ParamNode*>& out) {
  if (v.kind == Kind::kArray) {
    for (const ParamNode& item : v.items) collect_scalars(item, out);
  } else {
    out.push_back(&v);
  }
}

// Whether the items of a value of this type are tables.
bool holds_tables(KeyType type) {
  return type == KeyType::kTables || type == KeyType::kTablesOrString;
}

bool is_number_type(KeyType type) {
  return type != KeyType::kString && type != KeyType::kStrings && type != KeyType::kBool;
}

bool contains(const std::vector<std::string>& list, const std::string& word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

// "not in this version": the whole key, or one of its values.
Diagnostic later_error(const Key& key, const ParamNode& v, const std::string& shown,
                       const std::string& value) {
  std::string name = shown;
  if (key.type == KeyType::kTables) name = "[[" + last_name(key.path) + "]]";
  if (!value.empty()) name += " = " + value;
  return {value.empty() ? v.key_where : v.where,
          "not in this version: " + key.later + " (" + name + ")", "remove it from the file"};
}

std::vector<Diagnostic> check_scalar(const Key& key, const ParamNode& v, const std::string& shown) {
  const bool word = is_string(v) && !(is_number_type(key.type) && is_number(v));
  const std::string literal = word ? "\"" + v.string + "\"" : describe(v);
  if (contains(key.later_values, word ? v.string : literal)) {
    return {later_error(key, v, shown, literal)};
  }
  if (word && !key.choices.empty() && !contains(key.choices, v.string)) {
    const std::string match = closest_match(v.string, key.choices);
    std::string hint = match.empty() ? "" : "did you mean \"" + match + "\"? ";
    return {{v.where, shown + ": \"" + v.string + "\" is not allowed here", hint + wanted(key)}};
  }
  if (!word && is_number_type(key.type) && is_number(v)) {
    const double x = number_of(v);
    const bool too_long = is_integer(v) && std::abs(x) > std::numeric_limits<int>::max();
    if (!std::isfinite(x) || too_long || !key.range.contains(x)) {
      return {{v.where, shown + ": " + shown_number(x) + " is out of range", wanted(key)}};
    }
  }
  return {};
}

// One pass over a parsed file against the table.
class Checker {
 public:
  explicit Checker(const Schema& schema) : schema_(schema) {}

  void check_table(const ParamNode& table, const std::string& path, const std::string& shown) {
    for (const auto& [name, value] : table.entries) check_entry(name, value, path, shown);
    check_required(table, path, shown);
  }

  std::vector<Diagnostic> take() { return std::move(found_); }

 private:
  void check_entry(const std::string& name, const ParamNode& value, const std::string& path,
                   const std::string& shown) {
    const Key* key = schema_.find(key_path(path, name));
    if (!key) key = schema_.find(key_path(path, name) + "[]");
    const std::string entry = key_path(shown, name);
    if (!key) return unknown_key(name, value, path, shown);
    const std::vector<Diagnostic> bad = check_value(*key, value, entry);
    found_.insert(found_.end(), bad.begin(), bad.end());
    if (!bad.empty()) return;
    if (key->type == KeyType::kTable) check_table(value, key->path, entry);
    if (!holds_tables(key->type)) return;
    for (std::size_t n = 0; n < value.items.size(); ++n) {
      check_table(value.items[n], key->path, fmt::format("{}[{}]", entry, n));
    }
  }

  void unknown_key(const std::string& name, const ParamNode& value, const std::string& path,
                   const std::string& shown) {
    const std::vector<std::string>& known = schema_.children(path);
    const std::string match = closest_match(name, known);
    std::string hint = "did you mean '" + key_path(shown, match) + "'?";
    if (match.empty()) {
      hint = "known here:";
      for (const std::string& child : known) hint += " " + child;
    }
    found_.push_back({value.key_where, "unknown key '" + key_path(shown, name) + "'", hint});
  }

  void check_required(const ParamNode& table, const std::string& path, const std::string& shown) {
    for (const std::string& name : schema_.children(path)) {
      if (table.find(name)) continue;
      const Key* key = schema_.find(key_path(path, name));
      if (!key || key->fallback != "required") continue;
      if (key->type == KeyType::kTable) {
        ParamNode empty;
        empty.where = table.where;
        check_required(empty, key->path, key_path(shown, name));
      } else {
        found_.push_back(
            {table.where, "missing key '" + key_path(shown, name) + "'", wanted(*key)});
      }
    }
  }

  const Schema& schema_;
  std::vector<Diagnostic> found_;
};

}  // namespace

std::string key_path(const std::string& table, const std::string& name) {
  return table.empty() ? name : name.empty() ? table : table + "." + name;
}

bool Range::contains(double x) const {
  return (min_open ? x > min : x >= min) && (max_open ? x < max : x <= max);
}

std::string Range::text() const {
  const bool low = std::isfinite(min), high = std::isfinite(max);
  if (low && high) {
    return (min_open ? "(" : "[") + shown_number(min) + ", " + shown_number(max) +
           (max_open ? ")" : "]");
  }
  if (low) return (min_open ? "> " : ">= ") + shown_number(min);
  if (high) return (max_open ? "< " : "<= ") + shown_number(max);
  return "";
}

Schema::Schema(std::string name, std::vector<Key> keys)
    : name_(std::move(name)), keys_(std::move(keys)) {
  for (const Key& key : keys_) {
    ARCHETIDE_CHECK(index_.emplace(key.path, key).second);
  }
  // Tables that have no row of their own are required when something in them is.
  for (const Key& key : keys_) {
    bool required = key.fallback == "required";
    for (std::string path = parent_of(key.path); !path.empty(); path = parent_of(path)) {
      const bool list = path.ends_with("[]");
      const auto [it, added] = index_.emplace(
          path, Key{.path = path, .type = list ? KeyType::kTables : KeyType::kTable});
      if (!added && !it->second.meaning.empty()) required = false;
      if (!list && required) it->second.fallback = "required";
      required = required && !list;
    }
  }
  for (const auto& [path, key] : index_) children_[parent_of(path)].push_back(last_name(path));
}

const Key* Schema::find(const std::string& path) const {
  const auto it = index_.find(path);
  return it == index_.end() ? nullptr : &it->second;
}

const std::vector<std::string>& Schema::children(const std::string& path) const {
  static const std::vector<std::string> none;
  const auto it = children_.find(path);
  return it == children_.end() ? none : it->second;
}

std::vector<Diagnostic> Schema::check(const ParamNode& root) const {
  Checker checker(*this);
  checker.check_table(root, "", "");
  return checker.take();
}

double number_of(const ParamNode& node) {
  if (node.kind == Kind::kInteger || node.kind == Kind::kNumber) return node.number;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (node.kind != Kind::kString || node.string.empty()) return nan;
  const char* at = node.string.c_str();
  char* end = nullptr;
  const double above_line = std::strtod(at, &end);
  if (end == at) return nan;
  if (*end == '\0') return above_line;
  if (*end != '/') return nan;
  at = end + 1;
  const double below_line = std::strtod(at, &end);
  return end == at || *end != '\0' ? nan : above_line / below_line;
}

std::vector<Diagnostic> check_value(const Key& key, const ParamNode& value,
                                    const std::string& shown) {
  if (!key.later.empty() && key.later_values.empty()) return {later_error(key, value, shown, "")};
  if (!has_type(value, key.type)) {
    return {{value.where, shown + ": " + describe(value) + " has the wrong type", wanted(key)}};
  }
  std::vector<Diagnostic> found;
  if (key.type == KeyType::kTable || holds_tables(key.type)) return found;
  std::vector<const ParamNode*> scalars;
  collect_scalars(value, scalars);
  for (const ParamNode* scalar : scalars) {
    const std::vector<Diagnostic> bad = check_scalar(key, *scalar, shown);
    found.insert(found.end(), bad.begin(), bad.end());
  }
  return found;
}

}  // namespace archetide
