#include "precompute/intake/nesting.h"

#include <cmath>
#include <set>
#include <utility>

#include "precompute/base/defects.h"

namespace archetide {
namespace {

Eigen::AlignedBox3d box_of(const TriMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.vertices) box.extend(x);
  return box;
}

std::vector<TriMesh> split(const TriMesh& mesh, const std::vector<int>& shell, int count) {
  std::vector<std::vector<int>> lists(count);
  for (int t = 0; t < static_cast<int>(shell.size()); ++t) lists[shell[t]].push_back(t);
  std::vector<TriMesh> parts;
  for (const std::vector<int>& list : lists) parts.push_back(part_of(mesh, list));
  return parts;
}

}  // namespace

int Nesting::sense(int s) const {
  int root = s;
  while (parent[root] >= 0) root = parent[root];
  return (volume[s] > 0) == (volume[root] > 0) ? 1 : -1;
}

TriMesh Nesting::facing_outward(int s) const {
  TriMesh part = parts[s];
  if ((volume[s] > 0) != (sense(s) > 0)) turn_round(part);
  return part;
}

Nesting nest_shells(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges,
                    const std::vector<std::pair<int, int>>& crossing) {
  Nesting n;
  int count = 0;
  n.shell = shells(mesh, edges, count);
  n.parts = split(mesh, n.shell, count);
  n.parent.assign(count, -1);
  n.depth.assign(count, 0);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const TriMesh& part : n.parts) {
    n.volume.push_back(enclosed_volume(part));
    boxes.push_back(box_of(part));
  }
  std::set<std::pair<int, int>> touching;
  for (const auto& [s, t] : crossing) touching.insert(std::minmax(n.shell[s], n.shell[t]));

  for (int s = 0; s < count; ++s) {
    for (int o = 0; o < count; ++o) {
      if (o == s || touching.count(std::minmax(s, o)) || !boxes[o].contains(boxes[s])) continue;
      if (std::abs(winding_number(n.parts[o], n.parts[s].vertices[0])) < 0.5) continue;
      ++n.depth[s];
      const int old = n.parent[s];
      if (old < 0 || std::abs(n.volume[o]) < std::abs(n.volume[old])) n.parent[s] = o;
    }
  }
  return n;
}

void turn_round(TriMesh& mesh) {
  for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
}

}  // namespace archetide
