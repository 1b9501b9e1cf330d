#include "runtime/contact/overlap.h"

#include <algorithm>

#include "runtime/solid/extent.h"

namespace archetide {
namespace {

/// The deepest of the centre of `a`, its corners and the middles of its faces inside `b`, m; 0 when
/// none is.
double depth(const ReducedBody& a, const ReducedBody& b) {
  const GridSdf& sdf = b.archetype->sdf;
  if (sdf.values.empty()) return 0.0;
  const Quat turn = b.rotation.conjugate();
  const auto distance = [&](const Vec3& x) {
    const Vec3 at = a.position + a.rotation * x;
    return sdf.value(turn * (at - b.position));
  };
  const TriMesh& surface = a.archetype->surface;
  // The centre of a ring is not in the ring.
  const double own = a.archetype->sdf.value(Vec3::Zero());
  double least = std::min(0.0, std::max(own, distance(Vec3::Zero())));
  for (const Vec3& x : surface.vertices) least = std::min(least, distance(x));
  for (const Vec3i& t : surface.triangles) {
    const auto& v = surface.vertices;
    least = std::min(least, distance((v[t[0]] + v[t[1]] + v[t[2]]) / 3.0));
  }
  return -least;
}

}  // namespace

double overlap_depth(const ReducedBody& a, const ReducedBody& b) {
  const double reach = bounding_radius(*a.archetype) + bounding_radius(*b.archetype);
  if (!((a.position - b.position).norm() < reach)) return 0.0;
  return std::max(depth(a, b), depth(b, a));
}

double deepest_start(const ReducedBody& a, const ReducedBody& b, double cell) {
  constexpr double kOfReach = 0.1;
  return std::min(
      cell, kOfReach * std::min(bounding_radius(*a.archetype), bounding_radius(*b.archetype)));
}

}  // namespace archetide
