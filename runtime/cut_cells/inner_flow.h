#pragma once

#include <array>

#include "runtime/cut_cells/body_flux.h"

namespace archetide {

/// Potential flow inside a surface up to degree 3, v_a(x) = V_a + S_ab x_b + T_abc x_b x_c, S and T
/// symmetric in all indices and free of trace, that matches the normal velocity of each of a body's
/// motions best (least squares over the rest surface). Exact for translations, for spins and modes
/// of degree 2 of ellipsoids and modes of degree 3 of spheres. Rest frame; spins about its axes,
/// then modes.
struct InnerFlow {
  using Cubic = std::array<Mat3, 3>;  // T_a
  std::vector<Vec3> V;                // 3 + r, m/s per unit y
  std::vector<Mat3> S;                // 3 + r, 1/s per unit y
  std::vector<Cubic> T;               // 3 + r, 1/(m s) per unit y
};
InnerFlow inner_flow(const Archetype& archetype);

/// The same of a body as it stands, in the world, with its translations.
class PlacedInnerFlow {
 public:
  PlacedInnerFlow(const InnerFlow& flow, const BodySurface& body);
  /// Component `axis` of v at a place in the world, per unit y, and of S x + sqrt(2) T x x, of
  /// which the square is what strains of the flow add to a sphere's energy (DualFace).
  void at(const Vec3& place, int axis, VecX& whole, VecX& strain) const;

 private:
  Vec3 centre_;
  // Row d of an axis: of motion d about the body's centre V_a, S_a and T_a (xx, yy, zz, and twice
  // xy, xz, yz).
  std::array<Eigen::Matrix<double, Eigen::Dynamic, 10>, 3> axis_;
};

}  // namespace archetide
