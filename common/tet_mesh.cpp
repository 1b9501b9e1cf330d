#include "common/tet_mesh.h"

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

}  // namespace

double tet_volume(const TetMesh& mesh, int tet) {
  const std::array<int, 4>& t = mesh.tets[tet];
  const Vec3& x0 = mesh.nodes[t[0]];
  return (mesh.nodes[t[1]] - x0).dot((mesh.nodes[t[2]] - x0).cross(mesh.nodes[t[3]] - x0)) / 6.0;
}

TriMesh boundary_surface(const TetMesh& mesh, std::vector<int>& surface_to_node) {
  TriMesh surface;
  std::vector<int> node_to_surface(mesh.nodes.size(), -1);
  for (const int face : boundary_faces(mesh)) {
    const std::array<int, 4>& tet = mesh.tets[face / 4];
    const std::array<int, 3>& corners = kFaces[face % 4];
    surface.triangles.emplace_back(tet[corners[0]], tet[corners[1]], tet[corners[2]]);
    for (const int node : surface.triangles.back()) node_to_surface[node] = 0;
  }

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
