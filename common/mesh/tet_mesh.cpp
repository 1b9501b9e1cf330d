#include "common/mesh/tet_mesh.h"

#include <algorithm>

namespace archetide {
namespace {

// Faces of a positively oriented tet, outward.
constexpr std::array<std::array<int, 3>, 4> kFaces = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

struct FaceKey {
  std::array<int, 3> nodes;  // ascending
  int face;                  // 4 * tet + face of the tet
};

std::vector<FaceKey> sorted_faces(const TetMesh& mesh) {
  std::vector<FaceKey> keys;
  keys.reserve(4 * mesh.tets.size());
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) {
    for (int f = 0; f < 4; ++f) {
      FaceKey key{
          {mesh.tets[t][kFaces[f][0]], mesh.tets[t][kFaces[f][1]], mesh.tets[t][kFaces[f][2]]},
          4 * t + f};
      std::sort(key.nodes.begin(), key.nodes.end());
      keys.push_back(key);
    }
  }
  std::sort(keys.begin(), keys.end(),
            [](const FaceKey& a, const FaceKey& b) { return a.nodes < b.nodes; });
  return keys;
}

/// Faces that belong to exactly one tet, in the order of the tets.
std::vector<int> boundary_faces(const TetMesh& mesh) {
  const std::vector<FaceKey> keys = sorted_faces(mesh);
  std::vector<int> faces;
  for (std::size_t i = 0; i < keys.size();) {
    std::size_t end = i + 1;
    while (end < keys.size() && keys[end].nodes == keys[i].nodes) ++end;
    if (end - i == 1) faces.push_back(keys[i].face);
    i = end;
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

/// The middle node between two corners of a quadratic tet.
int mid_node(const TetMesh& mesh, int tet, int a, int b) {
  for (int e = 0; e < 6; ++e) {
    const auto& [p, q] = kTetEdges[e];
    if ((p == a && q == b) || (p == b && q == a)) return mesh.mids[tet][e];
  }
  return -1;
}

/// The flat triangles of a boundary face: one, or four around the middle nodes.
void add_face(const TetMesh& mesh, int face, std::vector<Vec3i>& triangles) {
  const int tet = face / 4;
  const std::array<int, 3>& f = kFaces[face % 4];
  const Vec3i v(mesh.tets[tet][f[0]], mesh.tets[tet][f[1]], mesh.tets[tet][f[2]]);
  if (mesh.order() == 1) {
    triangles.push_back(v);
    return;
  }
  const Vec3i m(mid_node(mesh, tet, f[0], f[1]), mid_node(mesh, tet, f[1], f[2]),
                mid_node(mesh, tet, f[2], f[0]));
  for (const Vec3i& t : {Vec3i(v[0], m[0], m[2]), Vec3i(v[1], m[1], m[0]), Vec3i(v[2], m[2], m[1]),
                         Vec3i(m[0], m[1], m[2])})
    triangles.push_back(t);
}

}  // namespace

double tet_volume(const TetMesh& mesh, int tet) {
  const std::array<int, 4>& t = mesh.tets[tet];
  const Vec3& x0 = mesh.nodes[t[0]];
  return (mesh.nodes[t[1]] - x0).dot((mesh.nodes[t[2]] - x0).cross(mesh.nodes[t[3]] - x0)) / 6.0;
}

std::vector<int> tets_at_boundary(const TetMesh& mesh) {
  std::vector<int> tets;
  for (const int face : boundary_faces(mesh))
    tets.insert(tets.end(), mesh.order() == 1 ? 1 : 4, face / 4);
  return tets;
}

TriMesh boundary_surface(const TetMesh& mesh, std::vector<int>& surface_to_node) {
  TriMesh surface;
  std::vector<int> node_to_surface(mesh.nodes.size(), -1);
  for (const int face : boundary_faces(mesh)) add_face(mesh, face, surface.triangles);
  for (const Vec3i& t : surface.triangles)
    for (const int node : t) node_to_surface[node] = 0;

  // Number the surface vertices in the order of their nodes.
  surface_to_node.clear();
  for (int node = 0; node < static_cast<int>(mesh.nodes.size()); ++node) {
    if (node_to_surface[node] < 0) continue;
    node_to_surface[node] = static_cast<int>(surface_to_node.size());
    surface_to_node.push_back(node);
    surface.vertices.push_back(mesh.nodes[node]);
  }
  for (Vec3i& t : surface.triangles) {
    for (int& v : t) v = node_to_surface[v];
  }
  return surface;
}

}  // namespace archetide
