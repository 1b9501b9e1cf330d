#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/types.h"
#include "common/params/schema.h"

namespace archetide {

/// A typed view of one table of a validated file. Paths are relative to the table and may be dotted
/// ("material.density"). A value that the file lacks is the schema's default; one that has no
/// default is a bug of the caller (AssertionError), who must call has() first. Every look-up marks
/// the key as read.
class Section {
 public:
  /// True when the file itself has the key.
  bool has(const std::string& path) const;

  bool boolean(const std::string& path) const;
  int integer(const std::string& path) const;
  double number(const std::string& path) const;
  std::string string(const std::string& path) const;
  std::vector<std::string> strings(const std::string& path) const;
  Vec3 vec3(const std::string& path) const;
  Vec3i int_vec3(const std::string& path) const;
  std::vector<Vec3> points(const std::string& path) const;
  /// For types that may be strings: true when the value (or the default) is a string.
  bool is_string(const std::string& path) const;

  /// A table; when the file lacks it, one in which every key has its default.
  Section section(const std::string& path) const;
  /// The entries of a list of tables.
  std::vector<Section> sections(const std::string& path) const;

  /// Where the value stands; of an absent key, where its table stands.
  SourceLocation location(const std::string& path = "") const;
  /// The path as the user reads it, from the top of the file: "body[1].modes".
  std::string shown(const std::string& path = "") const;
  /// A complaint about a value that the schema alone cannot judge.
  Diagnostic error(const std::string& path, const std::string& what,
                   const std::string& hint = "") const;

 private:
  friend class Document;
  struct State;
  const ParamNode* find(const std::string& path) const;
  const ParamNode& value(const std::string& path) const;
  std::string schema_path(const std::string& path) const;

  std::shared_ptr<State> state_;
  const ParamNode* node_ = nullptr;  // null: the file lacks this table
  std::string path_;                 // in the schema, "body[]"
  std::string shown_;                // "body[1]"
  SourceLocation where_;
};

/// A parsed file, overridden by --set and validated against its schema: either everything in it is
/// fine, or the InputError lists everything that is not.
class Document {
 public:
  /// Throws FileError when the file cannot be read, InputError for all that is wrong in it.
  static Document read(const std::string& path, const Schema& schema,
                       const std::vector<std::string>& overrides = {});
  static Document parse(const std::string& text, const std::string& file, const Schema& schema,
                        const std::vector<std::string>& overrides = {});

  Section root() const;
  /// TOML of exactly what was read: the file's own text, or rewritten when there were overrides.
  std::string text() const;
  /// Keys that the file has and no look-up has read, as "file:line:column: key": our bug if there
  /// is any.
  std::vector<std::string> unread() const;
  /// Throws AssertionError when a key of the file was never read.
  void check_all_read() const;

 private:
  std::shared_ptr<Section::State> state_;
};

/// Throws InputError when there is any complaint.
void throw_if_any(const std::vector<Diagnostic>& diagnostics);

}  // namespace archetide
