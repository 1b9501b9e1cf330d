#pragma once

#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "common/base/byte_stream.h"
#include "common/files/surface_io.h"
#include "shapes.h"

namespace archetide::testing_meshes {

/// The text of an OFF file.
inline std::string as_off(const TriMesh& m) {
  std::ostringstream text;
  text.precision(17);
  text << "OFF " << m.vertices.size() << ' ' << m.triangles.size() << " 0\n";
  for (const Vec3& x : m.vertices) text << x.transpose() << '\n';
  for (const Vec3i& t : m.triangles) text << "3 " << t.transpose() << '\n';
  return text.str();
}

/// A new folder for the files of one test, removed at its end.
class ScratchFolder {
 public:
  ScratchFolder()
      : path_(fmt::format("{}archetide_{}_{}", testing::TempDir(), ::getpid(), unique())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  std::string file(const std::string& name) const { return path_ + "/" + name; }
  std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(file(name), std::ios::binary) << bytes;
    return file(name);
  }

 private:
  static std::string unique() {
    static int count = 0;
    return std::to_string(++count);
  }
  std::string path_;
};

inline SurfaceFile as_file(TriMesh mesh) {
  SurfaceFile file;
  file.path = "shape.obj";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    file.face_numbers.push_back(static_cast<int>(t) + 1);
  file.mesh = std::move(mesh);
  return file;
}

/// Unit cube from `at`, 12 outward triangles.
inline TriMesh cube(const Vec3& at = Vec3::Zero(), double size = 1.0) {
  TriMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.push_back(at + size * Vec3(i & 1, i >> 1 & 1, i >> 2));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline TriMesh joined(TriMesh a, const TriMesh& b) {
  const int shift = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Vec3i& t : b.triangles) a.triangles.push_back(t.array() + shift);
  return a;
}

/// Unit cubes in a row that overlap; their union takes minutes when there are thousands.
inline TriMesh row_of_cubes(int count) {
  TriMesh row;
  for (int k = 0; k < count; ++k)
    row = joined(std::move(row), cube(Vec3(0.7 * k, 0, 0.01 * (k % 3))));
  return row;
}

/// Facing the other way.
inline TriMesh turned(TriMesh mesh) {
  for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Corners at distance 1 on the axes.
inline TriMesh octahedron() {
  TriMesh mesh;
  mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                    {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return mesh;
}

}  // namespace archetide::testing_meshes
