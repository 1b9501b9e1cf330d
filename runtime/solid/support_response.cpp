#include "runtime/solid/support_response.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/solid/extent.h"

namespace archetide {
namespace {

/// How far above its lowest point a body still counts as touching, of its radius [D59].
constexpr double kSupportHeight = 0.1;

/// Least and largest height of the surface above the centre of mass, m.
struct Heights {
  double low = INFINITY, high = -INFINITY;
};
Heights heights_of(const Archetype& a, const Vec3& up) {
  Heights heights;
  for (const Vec3& x : a.surface.vertices) {
    heights.low = std::min(heights.low, up.dot(x));
    heights.high = std::max(heights.high, up.dot(x));
  }
  return heights;
}

/// The lowest part of a body: means over what of its surface looks down there, projected along up.
struct Patch {
  double area = 0.0;        // m^2
  Vec3 arm = Vec3::Zero();  // place less the centre of mass, rest frame, m
  VecX c;                   // r: displacement along up per unit q, m
};

void add_vertex(const Archetype& a, int v, double area, const Vec3& up, Patch& patch) {
  patch.area += area;
  patch.arm += area * a.surface.vertices[v];
  patch.c += area * (a.surface_modes.block(3 * v, 0, 3, patch.c.size()).transpose() * up);
}

/// Of the vertices that are at most `top` above the centre of mass along `up` (rest frame).
Patch patch_below(const Archetype& a, int r, const Vec3& up, double top) {
  Patch patch;
  patch.c = VecX::Zero(r);
  for (const Vec3i& t : a.surface.triangles) {
    const Vec3 x[3] = {a.surface.vertices[t[0]], a.surface.vertices[t[1]],
                       a.surface.vertices[t[2]]};
    const double down = -0.5 * up.dot((x[1] - x[0]).cross(x[2] - x[0]));
    for (int k = 0; k < 3; ++k)
      if (down > 0.0 && up.dot(x[k]) <= top) add_vertex(a, t[k], down / 3.0, up, patch);
  }
  patch.arm /= patch.area, patch.c /= patch.area;
  return patch;
}

/// 1 / m_s = 1 / m + (a x n)^T I^-1 (a x n); arm and up in the rest frame.
double mass_at(const ReducedBody& body, const Vec3& arm, const Vec3& up) {
  const MomentumIntegrals& m = body.archetype->integrals;
  const Mat3 inertia = m.Sxx.trace() * Mat3::Identity() - m.Sxx;
  const Vec3 lever = arm.cross(up);
  return body.mass_scale / (1.0 / m.mass + lever.dot(inertia.ldlt().solve(lever)));
}

/// No point sinks deeper than to the height of those that are stopped.
double within_height(const SupportResponse& support, double deformation) {
  return std::min(deformation, support.height);
}

}  // namespace

SupportResponse support_response(const ReducedBody& body, const Vec3& up) {
  const Archetype& a = *body.archetype;
  const int r = body.nodes ? a.r() : body.r;
  if (r == 0) return {};
  const double radius = bounding_radius(a);
  const Vec3 n = body.rotation.conjugate() * up;
  const Heights heights = heights_of(a, n);
  const Patch patch = patch_below(a, r, n, heights.low + kSupportHeight * radius);
  const VecX bend = a.K_r.topLeftCorner(r, r).ldlt().solve(patch.c);
  const VecX rate = a.M_r.topLeftCorner(r, r).ldlt().solve(patch.c) / body.mass_scale;
  return {mass_at(body, patch.arm, n),
          patch.c.dot(rate),
          patch.c.dot(bend),
          largest_displacement(a.surface_modes.leftCols(r) * bend) / radius,
          (heights.high - heights.low) / radius,
          patch.area};
}

double slammed_water(const SupportResponse& support, double density) {
  return 4.0 / 3.0 * density * std::pow(support.area / std::numbers::pi, 1.5);
}

double resting_deformation(const SupportResponse& support, double pull) {
  return within_height(support, support.deformation * support.mass * pull);
}

double impact_deformation(const SupportResponse& support, double v, double struck) {
  if (support.compliance <= 0.0 || struck <= 0.0) return 0.0;
  const double m = 1.0 / (1.0 / support.mass + 1.0 / struck), s = m * support.mobility;
  const double energy = 0.5 * m * v * v * s / (1.0 + s);  // J
  return within_height(support, support.deformation * std::sqrt(2.0 * energy / support.compliance));
}

}  // namespace archetide
