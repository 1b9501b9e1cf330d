#include <bit>
#include <cmath>
#include <map>
#include <numbers>

#include "precompute/intake/cut.h"

namespace archetide {
namespace {

TriMesh box(const Vec3& low, const Vec3& high) {
  TriMesh mesh;
  for (int v = 0; v < 8; ++v)
    mesh.vertices.emplace_back(v & 1 ? high[0] : low[0], v & 2 ? high[1] : low[1],
                               v & 4 ? high[2] : low[2]);
  for (const auto& [a, b, c, d] :
       {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
        std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}})
    mesh.triangles.insert(mesh.triangles.end(), {Vec3i(a, b, c), Vec3i(a, c, d)});
  return mesh;
}

/// Columns: two directions normal to `axis` and `axis` itself, right-handed.
Mat3 frame_along(const Vec3& axis) {
  Mat3 frame;
  frame.col(2) = axis.normalized();
  frame.col(0) = frame.col(2).unitOrthogonal();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

/// A box that ends at the plane.
TriMesh half_space(const Region::HalfSpace& h, double reach) {
  TriMesh mesh = box(Vec3(-reach, -reach, -2.0 * reach), Vec3(reach, reach, 0.0));
  const Mat3 frame = frame_along(h.normal);
  for (Vec3& x : mesh.vertices) x = h.point + frame * x;
  return mesh;
}

TriMesh cylinder(const Region::Cylinder& c) {
  constexpr int kSides = 128;
  const Mat3 frame = frame_along(c.to - c.from);
  TriMesh mesh;
  for (const Vec3& end : {c.from, c.to})
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kSides;
      mesh.vertices.push_back(
          end + c.radius * (std::cos(angle) * frame.col(0) + std::sin(angle) * frame.col(1)));
    }
  mesh.vertices.insert(mesh.vertices.end(), {c.from, c.to});
  for (int i = 0; i < kSides; ++i) {
    const int j = (i + 1) % kSides, top = kSides;
    mesh.triangles.insert(mesh.triangles.end(),
                          {Vec3i(i, j, top + j), Vec3i(i, top + j, top + i),
                           Vec3i(2 * kSides, j, i), Vec3i(2 * kSides + 1, top + i, top + j)});
  }
  return mesh;
}

/// An octahedron's faces cut into four again and again; the corners lie on the sphere.
TriMesh ball(const Vec3& centre, double radius) {
  constexpr int kTimes = 5;
  TriMesh mesh;
  for (const int sign : {1, -1})
    for (int axis = 0; axis < 3; ++axis) mesh.vertices.push_back(sign * Vec3::Unit(axis));
  for (int octant = 0; octant < 8; ++octant) {
    const Vec3i t(octant & 1 ? 3 : 0, octant & 2 ? 4 : 1, octant & 4 ? 5 : 2);
    const bool odd = std::popcount(unsigned(octant)) % 2 == 1;
    mesh.triangles.push_back(odd ? Vec3i(t[0], t[2], t[1]) : t);
  }
  for (int time = 0; time < kTimes; ++time) {
    std::map<std::pair<int, int>, int> middle;
    const auto midpoint = [&](int a, int b) {
      const auto [at, is_new] = middle.try_emplace(std::minmax(a, b), int(mesh.vertices.size()));
      if (is_new) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
      return at->second;
    };
    std::vector<Vec3i> finer;
    for (const Vec3i& t : mesh.triangles) {
      const int ab = midpoint(t[0], t[1]), bc = midpoint(t[1], t[2]), ca = midpoint(t[2], t[0]);
      finer.insert(finer.end(), {Vec3i(t[0], ab, ca), Vec3i(t[1], bc, ab), Vec3i(t[2], ca, bc),
                                 Vec3i(ab, bc, ca)});
    }
    mesh.triangles = std::move(finer);
  }
  for (Vec3& x : mesh.vertices) x = centre + radius * x;
  return mesh;
}

}  // namespace

TriMesh region_surface(const Region& region, double reach) {
  if (region.box) return box(region.box->first, region.box->second);
  if (region.ball) return ball(region.ball->first, region.ball->second);
  if (region.cylinder) return cylinder(*region.cylinder);
  return half_space(region.half_space.value(), reach);
}

}  // namespace archetide
