#include "runtime/coupling/hydrostatic_stiffness.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/axial.h"
#include "common/mesh/tri_mesh.h"
#include "runtime/solid/nodal_space.h"

namespace archetide {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// B of every vertex, 3 n x r (Eq. S3).
Rows modes_in_world(const BodySurface& s) {
  const MatX& modes = wet_modes(*s.body);
  const int r = s.body->r;
  const ShapeCorrection& shape = s.terms.shape;
  const MatX shift = s.R * shape.shift_rate;
  Rows U = modes.leftCols(r);
  for (std::size_t v = 0; v < s.points.size(); ++v) {
    const Vec3 arm = s.points[v] - s.centre;
    auto u = U.middleRows<3>(3 * static_cast<Eigen::Index>(v));
    u = (shape.s * s.R * u + shift + arm * shape.slope.transpose() +
         skew(arm) * s.terms.spin_of_modes)
            .eval();
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

std::vector<Still> still_pressures(const Grid& g, const BodySurface& s,
                                   const PressureSystem& water) {
  std::vector<Still> still;
  for (const Vec3& x : s.points) still.push_back(still_pressure(g, water, x));
  return still;
}

// work(corners, change) of every triangle under pressure.
template <class Work>
void for_each_pressed(const BodySurface& s, const std::vector<Still>& still, const Work& work) {
  for (const Vec3i& t : wet_triangles(*s.body)) {
    const Still at[3] = {still[t[0]], still[t[1]], still[t[2]]};
    if (at[0].p == 0.0 && at[1].p == 0.0 && at[2].p == 0.0) continue;
    const Vec3 x[3] = {s.points[t[0]], s.points[t[1]], s.points[t[2]]};
    work(t, TriangleChange(x, at));
  }
}

// Force and virial of what presses on the surface: sum f, N, and sum f . arm, N m.
struct Pressed {
  Vec3 force = Vec3::Zero();
  double virial = 0.0;
};

Pressed pressed(const BodySurface& s, const std::vector<Still>& still) {
  Pressed sum;
  for_each_pressed(s, still, [&](const Vec3i& t, const TriangleChange& change) {
    for (int a = 0; a < 3; ++a) {
      const Vec3 f = -change.weight[a] * change.N;
      sum.force += f, sum.virial += f.dot(s.points[t[a]] - s.centre);
    }
  });
  return sum;
}

// `still`: what the mean pressure leaves; `force`: of all of it, N.
HydrostaticStiffness stiffness_of_modes(const BodySurface& s, const std::vector<Still>& still,
                                        double mean, const Vec3& force) {
  const int r = s.body->r;
  const auto count = static_cast<Eigen::Index>(s.points.size());
  const Rows U = modes_in_world(s);
  Rows dp(count, r), on_normal = Rows::Zero(U.rows(), r), on_pressure = Rows::Zero(U.rows(), r);
  for (Eigen::Index v = 0; v < count; ++v)
    dp.row(v) = still[v].slope.transpose() * U.middleRows<3>(3 * v);
  for_each_pressed(s, still, [&](const Vec3i& t, const TriangleChange& change) {
    const double *u[3], *of_p[3];
    double *to_normal[3], *to_pressure[3];
    for (int a = 0; a < 3; ++a) {
      u[a] = &U(3L * t[a], 0), of_p[a] = &dp(t[a], 0);
      to_normal[a] = &on_normal(3L * t[a], 0), to_pressure[a] = &on_pressure(3L * t[a], 0);
    }
    change.add(r, u, of_p, to_normal, to_pressure);
  });
  MatX of_normals = U.transpose() * on_normal;
  of_normals += mean * volume_curvature(*s.body);
  if (s.body->rung)  // −F d'', as d goes with −qᵀ C q (S2a)
    for (int k = 0; k < 3; ++k)
      of_normals +=
          2.0 * s.R.col(k).dot(force) * s.body->rung->swelling.centroid[k].topLeftCorner(r, r);
  const MatX whole = of_normals + U.transpose() * on_pressure;
  return {MatX(0.5 * (whole + whole.transpose())), of_normals};
}

// U^T Q U with U = A + B W^T, A: the nodes of the surface in the world, W^T = I^-1 D, B: [arm] of each
// vertex (Eq. S3), Q of its triangles.
class OfNodes {
 public:
  explicit OfNodes(const BodySurface& s) : s_(s), space_(*s.body->nodes) {
    out_.W = s.terms.spin_of_modes.transpose();
    out_.V = out_.V_of_rows = MatX::Zero(space_.size(), 3);
    for (int a = 0; a < 3; ++a) turn_.block<3, 3>(3 * a, 3 * a) = s.R;
  }

  static constexpr int kDofs = 9;  // of the corners of a triangle
  using Square = Eigen::Matrix<double, kDofs, kDofs, Eigen::RowMajor>;
  // Of a load that the frame's turns do not change, as a uniform pressure: the nodes alone.
  void add_without_turn(const Vec3i& t, const Square& Q) {
    const Square own = turn_.transpose() * Q * turn_;
    for (int i = 0; i < kDofs; ++i)
      for (int j = 0; j < kDofs; ++j) near_.emplace_back(dof(t, i), dof(t, j), own(i, j));
  }
  void add(const Vec3i& t, const Square& Q) {
    add_without_turn(t, Q);
    Eigen::Matrix<double, kDofs, 3> B;
    for (int a = 0; a < 3; ++a) B.middleRows<3>(3 * a) = skew(s_.points[t[a]] - s_.centre);
    const Eigen::Matrix<double, kDofs, 3> V = turn_.transpose() * Q * B,
                                          V_of_rows = turn_.transpose() * Q.transpose() * B;
    out_.G += B.transpose() * Q * B;
    for (int i = 0; i < kDofs; ++i) {
      const int row = dof(t, i);
      out_.V.row(row) += V.row(i), out_.V_of_rows.row(row) += V_of_rows.row(i);
    }
  }
  LoadStiffness take() {
    out_.near.resize(space_.size(), space_.size());
    out_.near.setFromTriplets(near_.begin(), near_.end());
    LoadStiffness K;
    K.nodes = std::make_shared<const NodalStiffness>(std::move(out_));
    return K;
  }

 private:
  int dof(const Vec3i& t, int i) const { return space_.first_dof(t[i / 3]) + i % 3; }

  const BodySurface& s_;
  const NodalSpace& space_;
  Square turn_ = Square::Zero();  // corners from the body frame to the world
  NodalStiffness out_;
  std::vector<Eigen::Triplet<double>> near_;
};

HydrostaticStiffness stiffness_of_nodes(const BodySurface& s, const std::vector<Still>& still,
                                        double mean) {
  using Square = OfNodes::Square;
  const Square one = Square::Identity();
  OfNodes whole(s), of_normals(s);
  const auto add = [&](const TriangleChange& change, const Square& dp, Square& on_normal,
                       Square& on_pressure) {
    const double *u[3], *of_p[3];
    double *to_normal[3], *to_pressure[3];
    for (int a = 0; a < 3; ++a) {
      u[a] = &one(3 * a, 0), of_p[a] = &dp(a, 0);
      to_normal[a] = &on_normal(3 * a, 0), to_pressure[a] = &on_pressure(3 * a, 0);
    }
    change.add(OfNodes::kDofs, u, of_p, to_normal, to_pressure);
  };
  for_each_pressed(s, still, [&](const Vec3i& t, const TriangleChange& change) {
    Square on_normal = Square::Zero(), on_pressure = Square::Zero(), dp = Square::Zero();
    for (int a = 0; a < 3; ++a) dp.block<1, 3>(a, 3 * a) = still[t[a]].slope.transpose();
    add(change, dp, on_normal, on_pressure);
    on_pressure += on_normal;
    whole.add(t, 0.5 * (on_pressure + on_pressure.transpose()));
    of_normals.add(t, on_normal);

    const Vec3 x[3] = {s.points[t[0]], s.points[t[1]], s.points[t[2]]};
    const Still everywhere[3] = {{mean}, {mean}, {mean}};
    Square of_mean = Square::Zero(), none = Square::Zero();
    add(TriangleChange(x, everywhere), Square::Zero(), of_mean, none);
    whole.add_without_turn(t, 0.5 * (of_mean + of_mean.transpose()));
    of_normals.add_without_turn(t, of_mean);
  });
  return {whole.take(), of_normals.take()};
}

}  // namespace

// The mean pressure (that whose virial is that of all) works on the volume, whose second derivatives
// are known as the strain tells it; the rest works on the triangles.
HydrostaticStiffness hydrostatic_stiffness(const Grid& g, const BodySurface& s,
                                           const PressureSystem& water) {
  std::vector<Still> still = still_pressures(g, s, water);
  const Pressed load = pressed(s, still);
  const double mean = -load.virial / (3.0 * enclosed_volume({s.points, wet_triangles(*s.body)}));
  for (Still& at : still) at.p -= mean;
  return s.body->nodes ? stiffness_of_nodes(s, still, mean)
                       : stiffness_of_modes(s, still, mean, load.force);
}

}  // namespace archetide
