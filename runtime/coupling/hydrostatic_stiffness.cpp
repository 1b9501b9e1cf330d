#include "runtime/coupling/hydrostatic_stiffness.h"

#include <algorithm>
#include <vector>

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

// −d f of the corners of a triangle, f_a = −N (p_a + Σ p) / 12 with N its area, as every mode moves
// the corners: what comes of N, and of p.
struct TriangleChange {
  Vec3 N, edge[3];   // −edge_b / 2 x u_b changes N, m
  double weight[3];  // (p_a + Σ p) / 12, Pa

  TriangleChange(const Vec3 x[3], const Still at[3]) {
    N = 0.5 * (x[1] - x[0]).cross(x[2] - x[0]);
    for (int a = 0; a < 3; ++a) {
      edge[a] = -0.5 * (x[(a + 1) % 3] - x[(a + 2) % 3]);
      weight[a] = (at[a].p + (at[0].p + at[1].p + at[2].p)) / 12.0;
    }
  }
  // u, dp: of the corners, rows of U and of the changes of p; on_normal, on_pressure: rows to add to.
  void add(int r, const double* const u[3], const double* const dp[3], double* const on_normal[3],
           double* const on_pressure[3]) const {
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3, c = (a + 2) % 3;
#pragma omp simd
      for (int i = 0; i < r; ++i) {
        const double change = (2.0 * dp[a][i] + (dp[b][i] + dp[c][i])) / 12.0;
        for (int k = 0; k < 3; ++k) on_pressure[a][k * r + i] += N[k] * change;
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int m = (k + 1) % 3, n = (k + 2) % 3;
#pragma omp simd
      for (int i = 0; i < r; ++i) {
        double change = 0.0;
        for (int a = 0; a < 3; ++a)
          change += edge[a][m] * u[a][n * r + i] - edge[a][n] * u[a][m * r + i];
        for (int a = 0; a < 3; ++a) on_normal[a][k * r + i] += weight[a] * change;
      }
    }
  }
};

}  // namespace

HydrostaticStiffness hydrostatic_stiffness(const Grid& g, const BodySurface& s,
                                           const PressureSystem& water) {
  const int r = s.body->r;
  const auto count = static_cast<Eigen::Index>(s.points.size());
  const Rows U = modes_in_world(s);
  Rows dp(count, r), on_normal = Rows::Zero(U.rows(), r), on_pressure = Rows::Zero(U.rows(), r);
  std::vector<Still> still;
  for (Eigen::Index v = 0; v < count; ++v) {
    still.push_back(still_pressure(g, water, s.points[v]));
    dp.row(v) = still[v].slope.transpose() * U.middleRows<3>(3 * v);
  }
  for (const Vec3i& t : wet_triangles(*s.body)) {
    const Still at[3] = {still[t[0]], still[t[1]], still[t[2]]};
    if (at[0].p == 0.0 && at[1].p == 0.0 && at[2].p == 0.0) continue;
    const Vec3 x[3] = {s.points[t[0]], s.points[t[1]], s.points[t[2]]};
    const double *u[3], *of_p[3];
    double *to_normal[3], *to_pressure[3];
    for (int a = 0; a < 3; ++a) {
      u[a] = &U(3L * t[a], 0), of_p[a] = &dp(t[a], 0);
      to_normal[a] = &on_normal(3L * t[a], 0), to_pressure[a] = &on_pressure(3L * t[a], 0);
    }
    TriangleChange(x, at).add(r, u, of_p, to_normal, to_pressure);
  }
  HydrostaticStiffness K{U.transpose() * on_pressure, U.transpose() * on_normal};
  K.whole += K.of_normals;
  K.whole = (0.5 * (K.whole + K.whole.transpose())).eval();
  return K;
}

}  // namespace archetide
