#pragma once

#include "runtime/coupling/body_flux.h"

namespace archetide {

/// Potential flow inside a surface, v(x) = V + S x with S symmetric and free of trace, that matches
/// the normal velocity of each of a body's motions best (least squares over the rest surface).
/// Exact for translations, and for modes of degree 2 and spins of ellipsoids. Rest frame; spins
/// about its axes, then modes.
struct InnerFlow {
  std::vector<Vec3> V;  // 3 + r, m/s per unit y
  std::vector<Mat3> S;  // 3 + r, 1/s per unit y
};
InnerFlow inner_flow(const Archetype& archetype);

/// The same of a body as it stands, in the world, with its translations: row d of axis(a) holds
/// (V_a, S_ax, S_ay, S_az) of motion d, about the body's centre.
class PlacedInnerFlow {
 public:
  PlacedInnerFlow(const InnerFlow& flow, const BodySurface& body);
  /// Component `axis` of v, and of its part S x alone, at a place in the world, per unit y.
  void at(const Vec3& place, int axis, VecX& whole, VecX& strain) const;

 private:
  Vec3 centre_;
  std::array<Eigen::Matrix<double, Eigen::Dynamic, 4>, 3> axis_;
};

}  // namespace archetide
