#include <fmt/core.h>

#include <bit>
#include <cstdint>
#include <cstring>

#include "common/files/surface_formats.h"

namespace archetide {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read in place");

constexpr std::size_t kHeader = 84,
                      kTriangle = 50;  // bytes: header with count; normal, corners, attribute

std::uint32_t triangle_count(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

void add_triangle(SurfaceFile& out) {
  const int end = static_cast<int>(out.mesh.vertices.size());
  add_face(out, {end - 3, end - 2, end - 1}, static_cast<int>(out.mesh.triangles.size()) + 1);
}

void read_binary(std::string_view bytes, SurfaceFile& out) {
  for (std::uint32_t t = 0; t < triangle_count(bytes); ++t) {
    float corners[9];
    std::memcpy(corners, bytes.data() + kHeader + kTriangle * t + 12, sizeof corners);
    for (int i = 0; i < 3; ++i) {
      out.mesh.vertices.emplace_back(corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]);
    }
    add_triangle(out);
  }
}

void read_text(std::string_view bytes, SurfaceFile& out) {
  TextScanner scan(bytes);
  std::size_t corners = 0;
  while (scan.next_line(false)) {
    const std::string_view keyword = scan.word();
    if (keyword == "vertex") {
      out.mesh.vertices.push_back(scan_point(scan, out.path));
      ++corners;
    } else if (keyword == "endfacet") {
      if (corners != 3) {
        refuse(out.path, scan.line(), fmt::format("a facet with {} corners instead of 3", corners));
      }
      add_triangle(out);
      corners = 0;
    }
  }
  if (corners != 0) refuse(out.path, scan.line(), "the file ends inside a facet");
}

}  // namespace

void read_stl(std::string_view bytes, SurfaceFile& out) {
  // Many binary files start with "solid" too, so the length decides, then the bytes.
  const std::size_t expected = kHeader + kTriangle * triangle_count(bytes);
  if (bytes.size() >= kHeader && bytes.size() == expected) return read_binary(bytes, out);
  const bool has_zeros = bytes.substr(0, 1000).find('\0') != std::string_view::npos;
  if (bytes.starts_with("solid") && !has_zeros) return read_text(bytes, out);
  refuse(out.path, 0,
         fmt::format("neither an ASCII STL file nor a whole binary one: its header announces {} "
                     "triangles ({} bytes), but it has {} bytes",
                     triangle_count(bytes), expected, bytes.size()),
         "the file is truncated or of another kind; export it again");
}

}  // namespace archetide
