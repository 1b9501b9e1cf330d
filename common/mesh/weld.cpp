#include "common/mesh/weld.h"

#include <array>
#include <map>

namespace archetide {

Weld merge_vertices(const TriMesh& mesh, const std::vector<int>& same_as) {
  Weld w;
  std::vector<int> number(mesh.vertices.size(), -1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3i corners = mesh.triangles[t].unaryExpr([&](int v) { return same_as[v]; });
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++w.collapsed;
      continue;
    }
    w.mesh.triangles.push_back(corners);
    w.kept.push_back(static_cast<int>(t));
    for (const int v : corners) number[v] = 0;
  }
  for (int v = 0; v < static_cast<int>(number.size()); ++v) {
    if (same_as[v] != v) ++w.welded;
    if (number[v] < 0) {
      if (same_as[v] == v) ++w.unused;
      continue;
    }
    number[v] = static_cast<int>(w.mesh.vertices.size());
    w.mesh.vertices.push_back(mesh.vertices[v]);
  }
  for (Vec3i& corners : w.mesh.triangles)
    corners = corners.unaryExpr([&](int v) { return number[v]; });
  return w;
}

Weld weld(const TriMesh& mesh) {
  std::map<std::array<double, 3>, int> first_with;
  std::vector<int> same_as;
  for (int v = 0; v < static_cast<int>(mesh.vertices.size()); ++v) {
    const Vec3& x = mesh.vertices[v];
    const std::array<double, 3> key = {x[0] + 0.0, x[1] + 0.0, x[2] + 0.0};  // -0 + 0 is 0
    same_as.push_back(first_with.try_emplace(key, v).first->second);
  }
  return merge_vertices(mesh, same_as);
}

}  // namespace archetide
