#include "runtime/output/tank_edges.h"

namespace archetide {
namespace {

void add_box(SurfaceMesh& mesh, const Vec3& low, const Vec3& high) {
  // Quads of the six faces, counter-clockwise seen from outside; corner c at (c & 1, c & 2, c & 4).
  constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (int f = 0; f < 6; ++f) {
    const int first = static_cast<int>(mesh.vertices.size());
    Vec3 normal = Vec3::Zero();
    normal[f / 2] = f % 2 ? 1.0 : -1.0;
    for (int c : kFaces[f]) {
      mesh.vertices.emplace_back((c & 1 ? high : low)[0], (c & 2 ? high : low)[1],
                                 (c & 4 ? high : low)[2]);
      mesh.normals.push_back(normal);
    }
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.triangles.emplace_back(first, first + 2, first + 3);
  }
}

}  // namespace

SurfaceMesh box_edges(const Vec3& low, const Vec3& high, double thickness) {
  SurfaceMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      Vec3 a = low - Vec3::Constant(thickness), b = high + Vec3::Constant(thickness);
      for (int side = 0; side < 2; ++side) {
        const int across = (axis + 1 + side) % 3;
        if (corner >> side & 1)
          a[across] = high[across];
        else
          b[across] = low[across];
      }
      add_box(mesh, a, b);
    }
  return mesh;
}

}  // namespace archetide
