#include <fmt/core.h>

#include <string>

#include "common/files/surface_formats.h"

namespace archetide {
namespace {

/// "7", "7/1", "7//3", "7/1/3", or negative: counted back from the last vertex so far.
int obj_corner(std::string_view word, int vertices, const std::string& path, int line) {
  int index = 0;
  if (!parse_integer(word.substr(0, word.find('/')), index) || index == 0) {
    refuse(path, line, "face corner: expected a vertex number, found \"" + std::string(word) + "\"",
           "OBJ numbers vertices from 1");
  }
  return index > 0 ? index - 1 : vertices + index;
}

void demand_corners(std::size_t corners, const std::string& path, int line) {
  if (corners < 3) refuse(path, line, fmt::format("a face with {} corners", corners));
}

/// Goes to the next line with something on it.
void demand_line(TextScanner& scan, const std::string& path, const std::string& what) {
  while (scan.next_line()) {
    if (scan.rest_of_line().find_first_not_of(" \t\r") != std::string_view::npos) return;
  }
  refuse(path, scan.line(), "the file ends before " + what);
}

}  // namespace

void read_obj(std::string_view bytes, SurfaceFile& out) {
  TextScanner scan(bytes);
  int faces = 0;
  std::vector<int> corners;
  while (scan.next_line()) {
    const std::string_view keyword = scan.word();
    if (keyword == "v") out.mesh.vertices.push_back(scan_point(scan, out.path));
    if (keyword != "f") continue;  // normals, texture, groups and materials do not matter here
    corners.clear();
    const int vertices = static_cast<int>(out.mesh.vertices.size());
    for (std::string_view word = scan.word(); !word.empty(); word = scan.word()) {
      corners.push_back(obj_corner(word, vertices, out.path, scan.line()));
    }
    demand_corners(corners.size(), out.path, scan.line());
    add_face(out, corners, ++faces);
  }
}

void read_off(std::string_view bytes, SurfaceFile& out) {
  TextScanner scan(bytes);
  demand_line(scan, out.path, "its header");
  const std::string header(scan.word());
  if (header != "OFF" && header != "COFF" && header != "NOFF") {
    refuse(out.path, scan.line(), "not an OFF file: it starts with \"" + header + "\"");
  }
  // The counts may stand on the header's line.
  if (scan.rest_of_line().find_first_of("0123456789") == std::string_view::npos) {
    demand_line(scan, out.path, "the counts of vertices and faces");
  }
  const int vertices = scan_integer(scan, out.path, "number of vertices");
  const int faces = scan_integer(scan, out.path, "number of faces");
  for (int v = 0; v < vertices; ++v) {
    demand_line(scan, out.path, fmt::format("vertex {} of {}", v + 1, vertices));
    out.mesh.vertices.push_back(scan_point(scan, out.path));
  }
  std::vector<int> corners;
  for (int f = 0; f < faces; ++f) {
    demand_line(scan, out.path, fmt::format("face {} of {}", f + 1, faces));
    const int count = scan_integer(scan, out.path, "number of corners");
    corners.clear();
    for (int i = 0; i < count; ++i) corners.push_back(scan_integer(scan, out.path, "face corner"));
    demand_corners(corners.size(), out.path, scan.line());
    add_face(out, corners, f + 1);
  }
}

}  // namespace archetide
