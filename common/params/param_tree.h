#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "common/base/input_error.h"

namespace archetide {

struct ParamEntry;

/// A parsed TOML value with the place it came from: what schema.h validates and params.h looks up.
struct ParamNode {
  enum class Kind { kBool, kInteger, kNumber, kString, kDate, kArray, kTable };
  Kind kind = Kind::kTable;
  bool boolean = false;
  std::int64_t integer = 0;
  double number = 0.0;  // of kNumber, and of kInteger as a double
  std::string string;
  std::vector<ParamNode> items;     // kArray
  std::vector<ParamEntry> entries;  // kTable, by place in the file
  SourceLocation where;             // of the value
  SourceLocation key_where;         // of its key

  const ParamNode* find(const std::string& name) const;
  ParamNode* find(const std::string& name);
  /// A list (not empty) with nothing but tables in it.
  bool is_table_list() const;
};

/// A key of a table and its value.
struct ParamEntry {
  std::string first;
  ParamNode second;
};

/// Parses TOML. `file` names the text in errors. Throws InputError with file:line:column.
ParamNode parse_param_text(const std::string& text, const std::string& file);

/// The text of a file. Throws FileError when it cannot be read.
std::string read_param_file(const std::string& path);

/// One `--set path=value`. In a path, `body[2].modes` is the third [[body]], `body.modes` all of
/// them. The value is TOML; a bare word is a string; the word `absent` takes the key away.
void apply_override(ParamNode& root, const std::string& assignment);

/// The tree as TOML text, every number to the last bit.
std::string to_toml(const ParamNode& root);

}  // namespace archetide
