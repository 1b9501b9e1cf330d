#include "runtime/coupling/hydrostatic_stiffness.h"

#include <algorithm>

#include "common/base/axial.h"

namespace archetide {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// R φ_i − (I⁻¹ D_i) × arm of every vertex, 3 n x r (Eq. S3 without the shape correction, which
// nonlinear bodies do not have).
Rows modes_in_world(const BodySurface& s) {
  const MatX& modes = wet_modes(*s.body);
  const int r = s.body->r;
  Rows U = modes.leftCols(r);
  for (std::size_t v = 0; v < s.points.size(); ++v) {
    auto u = U.middleRows<3>(3 * static_cast<Eigen::Index>(v));
    u = (s.R * u + skew(s.points[v] - s.centre) * s.terms.spin_of_modes).eval();
  }
  return U;
}

// Pressure, Pa, and its gradient, Pa/m.
struct Still {
  double p = 0.0;
  Vec3 slope = Vec3::Zero();
};

Still still_pressure(const Grid& g, const PressureSystem& water, const Vec3& x) {
  const Hydrostatics& hydro = water.hydrostatics;
  const Vec3 rho_g = hydro.density * hydro.gravity;
  const double level = interpolate(g, *water.surface.phi, x);
  if (level >= 0.0) return {};
  // phi ends at the edge of its band, the reference level knows nothing of waves
  return {std::max(rho_g.dot(x - hydro.reference), -level * rho_g.norm()), rho_g};
}

using Triangle = Eigen::Matrix<double, 9, 9>;

// −d f / dx of the corners of a triangle, f_a = −N (p_a + Σ p) / 12, N its area: by N and by p.
void triangle_stiffness(const Vec3 x[3], const Still at[3], Triangle& by_normal,
                        Triangle& by_pressure) {
  const Vec3 N = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
  const double sum = at[0].p + at[1].p + at[2].p;
  for (int b = 0; b < 3; ++b) {
    const Mat3 turn = -0.5 * skew(x[(b + 1) % 3] - x[(b + 2) % 3]);  // dN / dx_b
    for (int a = 0; a < 3; ++a) {
      by_normal.block<3, 3>(3 * a, 3 * b) = (at[a].p + sum) / 12.0 * turn;
      by_pressure.block<3, 3>(3 * a, 3 * b) =
          (a == b ? 2.0 : 1.0) / 12.0 * N * at[b].slope.transpose();
    }
  }
}

}  // namespace

HydrostaticStiffness hydrostatic_stiffness(const Grid& g, const BodySurface& s,
                                           const PressureSystem& water) {
  const int r = s.body->r;
  const Rows U = modes_in_world(s);
  Rows by_normal = Rows::Zero(U.rows(), r), by_pressure = Rows::Zero(U.rows(), r);
  std::vector<Still> still;
  still.reserve(s.points.size());
  for (const Vec3& x : s.points) still.push_back(still_pressure(g, water, x));
  Eigen::Matrix<double, 9, Eigen::Dynamic, Eigen::RowMajor> u(9, r), f(9, r);
  const auto add = [&](const Vec3i& t, const Triangle& K, Rows& to) {
    f.noalias() = K.lazyProduct(u);
    for (int a = 0; a < 3; ++a) to.middleRows<3>(3L * t[a]) += f.middleRows<3>(3L * a);
  };
  for (const Vec3i& t : wet_triangles(*s.body)) {
    const Still at[3] = {still[t[0]], still[t[1]], still[t[2]]};
    if (at[0].p == 0.0 && at[1].p == 0.0 && at[2].p == 0.0) continue;
    const Vec3 x[3] = {s.points[t[0]], s.points[t[1]], s.points[t[2]]};
    for (int a = 0; a < 3; ++a) u.middleRows<3>(3L * a) = U.middleRows<3>(3L * t[a]);
    Triangle K_normal, K_pressure;
    triangle_stiffness(x, at, K_normal, K_pressure);
    add(t, K_normal, by_normal);
    add(t, K_pressure, by_pressure);
  }
  HydrostaticStiffness K{U.transpose() * by_pressure, U.transpose() * by_normal};
  K.whole += K.of_normals;
  K.whole = (0.5 * (K.whole + K.whole.transpose())).eval();
  return K;
}

}  // namespace archetide
