#pragma once

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "common/base/input_error.h"
#include "common/params/param_tree.h"

namespace archetide {

/// What a key of an input file may hold. Wherever a number stands, a fraction in quotes ("1/192")
/// may too.
enum class KeyType {
  kBool,
  kInteger,
  kNumber,
  kString,
  kStrings,          // list of strings
  kVec3,             // [x, y, z]
  kIntVec3,          // [i, j, k]
  kPoints,           // list of [x, y, z]
  kPointsOrString,   // the same, or a string
  kIntegerOrString,  // an integer in range, or one of `choices`
  kVec3OrString,     // [x, y, z], or one of `choices`
  kTable,            // [section] or { ... }
  kTables,           // [[section]]
  kTablesOrString,   // the same or [{ ... }, ..], or a string
};

/// Allowed values of numbers (of every component of vectors). Infinity and NaN are never allowed.
struct Range {
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool min_open = false, max_open = false;  // true: the bound itself is not allowed

  bool contains(double x) const;
  /// "> 0", ">= 0", "(0, 0.5)", "[0, 1]"; "" when unbounded.
  std::string text() const;
};
inline Range above(double min) {
  return {min, std::numeric_limits<double>::infinity(), true, false};
}
inline Range at_least(double min) { return {.min = min}; }
inline Range between(double min, double max) { return {min, max, false, false}; }
inline Range strictly_between(double min, double max) { return {min, max, true, true}; }

/// Path of the key `name` of `table`: "table.name"; the other one where one is empty.
std::string key_path(const std::string& table, const std::string& name);

/// One row of the table that describes a kind of input file: the only place where a key's type,
/// unit, range and default are written down.
struct Key {
  std::string path;  // "fluid.water.level"; an entry of a list of tables is "body[].position"
  KeyType type = KeyType::kNumber;
  std::string unit = {};  // "m", "kg/m^3"; "" for pure numbers, words and tables
  Range range = {};
  std::string fallback = {};              // the default as TOML text, or "required", or "absent"
  std::vector<std::string> choices = {};  // of strings; empty: any string
  std::string meaning = {};
  /// Name of the feature when it is refused in this version; `later_values` narrows that to these
  /// values.
  std::string later = {};
  std::vector<std::string> later_values = {};
};

/// The keys of one kind of file. Tables between the keys need no row of their own unless their
/// absence means something: a table without row is required when a key in it is.
class Schema {
 public:
  Schema(std::string name, std::vector<Key> keys);

  const std::string& name() const { return name_; }
  /// In the order of the table; tables without a row are not among them.
  const std::vector<Key>& keys() const { return keys_; }
  /// The row of a path, or null.
  const Key* find(const std::string& path) const;
  /// Last names of the keys directly in the table `path` ("" = top level).
  const std::vector<std::string>& children(const std::string& path) const;

  /// Everything that is wrong with a parsed file, in the order of the file.
  std::vector<Diagnostic> check(const ParamNode& root) const;

  /// The table as text: aligned columns, JSON, or a Markdown table.
  std::string text() const;
  std::string json() const;
  std::string markdown() const;

 private:
  std::string name_;
  std::vector<Key> keys_;
  std::map<std::string, Key> index_;  // keys_ and the tables between them
  std::map<std::string, std::vector<std::string>> children_;
};

/// "number", "list of strings", "[x, y, z]", ...
std::string type_name(KeyType type);

/// The value of a number or of a fraction in a string; NaN when it is neither.
double number_of(const ParamNode& node);

/// Complaint about one value against its row (nothing when it is fine). `shown` is the path as the
/// user reads it.
std::vector<Diagnostic> check_value(const Key& key, const ParamNode& value,
                                    const std::string& shown);

}  // namespace archetide
