#pragma once

#include <string>
#include <string_view>

#include "common/files/surface_io.h"

namespace archetide {

// One reader for each format: `bytes` is the whole file, `out.path` its name. Indices are checked
// by the caller.
void read_obj(std::string_view bytes, SurfaceFile& out);
void read_off(std::string_view bytes, SurfaceFile& out);
void read_ply(std::string_view bytes, SurfaceFile& out);
void read_stl(std::string_view bytes, SurfaceFile& out);

/// Appends a face of the file, cut into a fan around its first corner. `number` is 1-based.
void add_face(SurfaceFile& out, const std::vector<int>& corners, int number);

/// Throws InputError at a line of the file (0: the file as a whole).
[[noreturn]] void refuse(const std::string& path, int line, const std::string& what,
                         const std::string& hint = "");

/// Walks a text line by line and word by word.
class TextScanner {
 public:
  explicit TextScanner(std::string_view bytes) : rest_(bytes) {}
  /// Goes to the next line; false at the end of the text. A '#' ends a line when comments are on.
  bool next_line(bool comments = true);
  /// The next word of this line, "" at its end.
  std::string_view word();
  int line() const { return line_; }
  std::string_view rest_of_line() const { return text_; }
  /// What follows this line.
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_, text_;
  int line_ = 0;
};

/// The next word of the line as a number. `what` names it in the refusal.
double scan_number(TextScanner& scan, const std::string& path, const std::string& what);
int scan_integer(TextScanner& scan, const std::string& path, const std::string& what);
Vec3 scan_point(TextScanner& scan, const std::string& path);

/// All of `word` as a number; false when it is none.
bool parse_number(std::string_view word, double& value);
bool parse_integer(std::string_view word, int& value);

}  // namespace archetide
