#include "common/files/surface_io.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/surface_formats.h"

namespace archetide {
namespace {

using Reader = void (*)(std::string_view, SurfaceFile&);

Reader reader_for(const std::string& path) {
  static const std::map<std::string, Reader> kReaders = {
      {".obj", read_obj}, {".off", read_off}, {".ply", read_ply}, {".stl", read_stl}};
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto found = kReaders.find(extension);
  return found == kReaders.end() ? nullptr : found->second;
}

std::string read_bytes(const std::string& path) {
  std::error_code problem;
  if (!std::filesystem::exists(path, problem)) throw FileError(path + ": no such mesh file");
  if (std::filesystem::is_directory(path, problem))
    throw FileError(path + ": a folder, not a mesh file");
  return read_whole_file(path);
}

void check_indices(const SurfaceFile& file) {
  const int n = static_cast<int>(file.mesh.vertices.size());
  for (std::size_t t = 0; t < file.mesh.triangles.size(); ++t) {
    for (const int v : file.mesh.triangles[t]) {
      if (v >= 0 && v < n) continue;
      refuse(file.path, 0,
             fmt::format("face {} names vertex {} (counted from 1), but the file has {} vertices",
                         file.face_numbers[t], static_cast<std::int64_t>(v) + 1, n));
    }
  }
}

}  // namespace

bool is_surface_file(const std::string& path) { return reader_for(path) != nullptr; }

SurfaceFile read_surface(const std::string& path) {
  return parse_surface(path, reader_for(path) ? read_bytes(path) : std::string());
}

SurfaceFile parse_surface(const std::string& path, std::string_view bytes) {
  const Reader read = reader_for(path);
  if (!read) refuse(path, 0, "unknown kind of surface file", "use .obj, .off, .ply or .stl");
  SurfaceFile file;
  file.path = path;
  read(bytes, file);
  check_indices(file);
  if (file.mesh.triangles.empty()) refuse(path, 0, "no faces in this file");
  return file;
}

void add_face(SurfaceFile& out, const std::vector<int>& corners, int number) {
  if (corners.size() > 3) ++out.polygons;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    out.mesh.triangles.emplace_back(corners[0], corners[i - 1], corners[i]);
    out.face_numbers.push_back(number);
  }
}

void refuse(const std::string& path, int line, const std::string& what, const std::string& hint) {
  throw InputError({Diagnostic{{path, line, 0}, what, hint}});
}

bool TextScanner::next_line(bool comments) {
  if (rest_.empty()) return false;
  const std::size_t end = rest_.find('\n');
  text_ = rest_.substr(0, end);
  rest_ = end == std::string_view::npos ? std::string_view() : rest_.substr(end + 1);
  ++line_;
  if (comments) text_ = text_.substr(0, text_.find('#'));
  return true;
}

std::string_view TextScanner::word() {
  constexpr std::string_view kBlank = " \t\r\v\f";
  const std::size_t start = text_.find_first_not_of(kBlank);
  if (start == std::string_view::npos) {
    text_ = {};
    return {};
  }
  const std::size_t end = std::min(text_.find_first_of(kBlank, start), text_.size());
  const std::string_view found = text_.substr(start, end - start);
  text_ = text_.substr(end);
  return found;
}

namespace {
template <class T>
bool parse_all(std::string_view word, T& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  return problem == std::errc() && end == word.data() + word.size();
}
}  // namespace

bool parse_number(std::string_view word, double& value) {
  if (parse_all(word, value)) return true;
  // from_chars refuses numbers too small for a double, which are zero for our purposes.
  const std::string copy(word);
  char* end = nullptr;
  value = std::strtod(copy.c_str(), &end);
  return !copy.empty() && *end == '\0';
}

bool parse_integer(std::string_view word, int& value) { return parse_all(word, value); }

double scan_number(TextScanner& scan, const std::string& path, const std::string& what) {
  const std::string_view word = scan.word();
  double value = 0.0;
  if (parse_number(word, value)) return value;
  refuse(path, scan.line(), what + ": expected a number, found \"" + std::string(word) + "\"");
}

int scan_integer(TextScanner& scan, const std::string& path, const std::string& what) {
  const std::string_view word = scan.word();
  int value = 0;
  if (parse_integer(word, value)) return value;
  refuse(path, scan.line(), what + ": expected an integer, found \"" + std::string(word) + "\"");
}

Vec3 scan_point(TextScanner& scan, const std::string& path) {
  Vec3 x;
  for (double& coordinate : x) coordinate = scan_number(scan, path, "coordinate");
  return x;
}

}  // namespace archetide
