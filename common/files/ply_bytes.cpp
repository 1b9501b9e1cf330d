#include "common/files/ply_bytes.h"

#include <fmt/core.h>

#include "common/base/byte_stream.h"

namespace archetide {

std::string ply_header(const std::string& comment, const std::string& type,
                       const std::vector<std::string>& properties, std::size_t vertices,
                       std::size_t faces) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  if (!comment.empty()) text += fmt::format("comment {}\n", comment);
  text += fmt::format("element vertex {}\n", vertices);
  for (const std::string& name : properties) text += fmt::format("property {} {}\n", type, name);
  return text + fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                            faces);
}

void append_ply_faces(std::string& bytes, const std::vector<Vec3i>& triangles) {
  for (const Vec3i& t : triangles) {
    append_number(bytes, static_cast<unsigned char>(3));
    for (const int v : t) append_number(bytes, v);
  }
}

}  // namespace archetide
