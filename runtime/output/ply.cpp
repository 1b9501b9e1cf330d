#include "runtime/output/ply.h"

#include <fmt/core.h>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/atomic_file.h"
#include "common/files/ply_bytes.h"

namespace archetide {
namespace {

constexpr std::size_t kVertexBytes = 6 * sizeof(float);

std::string header(std::size_t vertices, std::size_t faces) {
  return ply_header("archetide, metres, z up", "float", {"x", "y", "z", "nx", "ny", "nz"}, vertices,
                    faces);
}

// The count after "element vertex " or "element face ".
std::size_t element_count(const std::string& path, const std::string& bytes,
                          const std::string& name) {
  const std::size_t at = bytes.find("element " + name + ' ');
  if (at == std::string::npos) throw FileError(path + ": not a PLY file of this program");
  return std::strtoull(bytes.c_str() + at + name.size() + 9, nullptr, 10);
}

Vec3 take_vector(const std::string& bytes, std::size_t& offset) {
  Vec3 x;
  for (int a = 0; a < 3; ++a) x[a] = take_number<float>(bytes, offset);
  return x;
}

}  // namespace

void write_ply(const std::string& path, const SurfaceMesh& mesh) {
  std::string bytes = header(mesh.vertices.size(), mesh.triangles.size());
  bytes.reserve(bytes.size() + mesh.vertices.size() * kVertexBytes +
                mesh.triangles.size() * kPlyFaceBytes);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (const Vec3* x : {&mesh.vertices[v], &mesh.normals[v]})
      for (int a = 0; a < 3; ++a) append_number(bytes, static_cast<float>((*x)[a]));
  append_ply_faces(bytes, mesh.triangles);
  write_file_atomically(path, bytes);
}

SurfaceMesh read_ply(const std::string& path) {
  const std::string bytes = read_whole_file(path);
  const std::size_t vertices = element_count(path, bytes, "vertex");
  const std::size_t faces = element_count(path, bytes, "face");
  const std::string expected = header(vertices, faces);
  if (bytes.compare(0, expected.size(), expected) != 0)
    throw FileError(path + ": not a PLY file of this program");
  if (bytes.size() != expected.size() + vertices * kVertexBytes + faces * kPlyFaceBytes)
    throw FileError(path + ": truncated");

  SurfaceMesh mesh;
  std::size_t offset = expected.size();
  for (std::size_t v = 0; v < vertices; ++v) {
    mesh.vertices.push_back(take_vector(bytes, offset));
    mesh.normals.push_back(take_vector(bytes, offset));
  }
  for (std::size_t f = 0; f < faces; ++f) {
    ++offset;  // the count, always 3
    Vec3i t;
    for (int c = 0; c < 3; ++c) {
      t[c] = take_number<int>(bytes, offset);
      if (t[c] < 0 || static_cast<std::size_t>(t[c]) >= vertices)
        throw FileError(fmt::format("{}: face {} names a vertex that is not there", path, f));
    }
    mesh.triangles.push_back(t);
  }
  return mesh;
}

}  // namespace archetide
