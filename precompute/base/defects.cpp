#include "precompute/base/defects.h"

#include <fmt/core.h>

#include <sstream>
#include <unordered_map>

#include "common/base/byte_stream.h"
#include "common/files/atomic_file.h"
#include "common/files/ply_bytes.h"

namespace archetide {

TriMesh part_of(const TriMesh& mesh, const std::vector<int>& triangles) {
  TriMesh part;
  std::unordered_map<int, int> number;
  for (const int t : triangles) {
    part.triangles.push_back(mesh.triangles[t].unaryExpr([&](int v) {
      const auto [found, is_new] = number.try_emplace(v, static_cast<int>(part.vertices.size()));
      if (is_new) part.vertices.push_back(mesh.vertices[v]);
      return found->second;
    }));
  }
  return part;
}

void write_ply(const std::string& path, const TriMesh& mesh) {
  std::string bytes =
      ply_header("", "double", {"x", "y", "z"}, mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& x : mesh.vertices)
    for (const double coordinate : x) append_number(bytes, coordinate);
  append_ply_faces(bytes, mesh.triangles);
  write_file_atomically(path, bytes);
}

std::string place(const Vec3& x) {
  std::ostringstream text;
  text.precision(6);
  text << "(" << x[0] << ", " << x[1] << ", " << x[2] << ")";
  return text.str();
}

std::string counted(std::size_t n, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

}  // namespace archetide
