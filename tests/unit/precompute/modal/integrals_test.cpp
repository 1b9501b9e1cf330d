#include <gtest/gtest.h>

#include "precompute/modal/momentum_integrals.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

/// Cross product matrix.
Mat3 cross_matrix(const Vec3& w) {
  Mat3 W;
  W << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return W;
}

/// sum of the antisymmetric part: D with D = sum m y x u for C = sum m y u^T.
Vec3 axial(const Mat3& C) { return {C(1, 2) - C(2, 1), C(2, 0) - C(0, 2), C(0, 1) - C(1, 0)}; }

struct Body {
  TetMesh mesh;
  SparseMatrix mass;
  MatX modes;  // 3n x 4, any fields: not re-projected, so that every integral matters
  VecX q, q_dot;
  MomentumIntegrals integrals;

  explicit Body(MassKind kind) : mesh(shapes::tet_box(3, 2, 2, 0.3)) {
    move_to_centre_of_mass(mesh);
    mass = mass_matrix(mesh, Material{500.0, 1.0, 0.0}, kind);
    modes.resize(3 * Eigen::Index(mesh.nodes.size()), 4);
    for (Eigen::Index c = 0; c < 4; ++c)
      for (Eigen::Index i = 0; i < modes.rows(); ++i)
        modes(i, c) = std::sin(1.7 * double(i) + 0.9 * double(c * c));
    q = (VecX(4) << 0.03, -0.02, 0.05, 0.01).finished();
    q_dot = (VecX(4) << 0.4, 1.1, -0.6, 0.2).finished();
    integrals = momentum_integrals(mesh.nodes, mass, modes);
  }
  int n() const { return int(mesh.nodes.size()); }
  Vec3 position(int i) const {  // y = x + sum q phi
    return mesh.nodes[i] + (modes * q).segment<3>(3 * i);
  }
  Vec3 rate(int i) const { return (modes * q_dot).segment<3>(3 * i); }
  /// sum m f g^T by direct double sum over the mass matrix.
  template <class F, class G>
  Mat3 direct(F f, G g) const {
    Mat3 sum = Mat3::Zero();
    for (int j = 0; j < n(); ++j)
      for (SparseMatrix::InnerIterator m(mass, j); m; ++m)
        sum += m.value() * f(int(m.row())) * g(j).transpose();
    return sum;
  }
  /// sum m y u_i^T from the integrals: C_i = A_i + sum_j q_j B_ij^T.
  Mat3 C(int i) const {
    Mat3 sum = integrals.A[i];
    for (int j = 0; j < 4; ++j) sum += q[j] * integrals.B[4 * i + j].transpose();
    return sum;
  }
  /// sum m y y^T from the integrals.
  Mat3 Syy() const {
    Mat3 sum = integrals.Sxx;
    for (int i = 0; i < 4; ++i) {
      sum += q[i] * (integrals.A[i] + integrals.A[i].transpose());
      for (int j = 0; j < 4; ++j) sum += q[i] * q[j] * integrals.B[4 * i + j];
    }
    return sum;
  }
};

constexpr double kRoundOff = 1e-13;  // relative; double sums over 36 nodes, measured below 2e-15

class MomentumIntegralsOf : public ::testing::TestWithParam<MassKind> {};

TEST_P(MomentumIntegralsOf, ReproduceMassAndInertiaOfTheDeformedBody) {
  const Body b(GetParam());
  const auto y = [&](int i) { return b.position(i); };
  const auto one = [](int) { return Vec3(1, 0, 0); };
  EXPECT_NEAR(b.integrals.mass, b.direct(one, one)(0, 0), kRoundOff * b.integrals.mass);
  const Mat3 direct = b.direct(y, y), ours = b.Syy();
  const Mat3 inertia = direct.trace() * Mat3::Identity() - direct;
  EXPECT_LT((ours.trace() * Mat3::Identity() - ours - inertia).norm(), kRoundOff * inertia.norm());
}

TEST_P(MomentumIntegralsOf, ReproduceLinearAndAngularMomentum) {
  const Body b(GetParam());
  const Vec3 v(0.3, -0.8, 0.5), w(1.0, 2.0, -0.7);
  const auto y = [&](int i) { return b.position(i); };
  const auto velocity = [&](int i) -> Vec3 { return v + w.cross(b.position(i)) + b.rate(i); };
  const auto one = [](int) { return Vec3(1, 0, 0); };
  const Vec3 P = b.direct(one, velocity).row(0).transpose();
  const Vec3 L = axial(b.direct(y, velocity));

  Vec3 I3q = Vec3::Zero(), I3q_dot = Vec3::Zero(), Dq_dot = Vec3::Zero();
  for (int i = 0; i < 4; ++i) {
    I3q += b.q[i] * b.integrals.I3[i];
    I3q_dot += b.q_dot[i] * b.integrals.I3[i];
    Dq_dot += b.q_dot[i] * axial(b.C(i));
  }
  const Mat3 S = b.Syy();
  const Vec3 ours_P = b.integrals.mass * v + w.cross(I3q) + I3q_dot;
  const Vec3 ours_L = I3q.cross(v) + (S.trace() * w - S * w) + Dq_dot;
  EXPECT_LT((ours_P - P).norm(), kRoundOff * P.norm());
  EXPECT_LT((ours_L - L).norm(), kRoundOff * L.norm());
}

TEST_P(MomentumIntegralsOf, ReproduceKineticEnergy) {
  const Body b(GetParam());
  const Vec3 w(1.0, 2.0, -0.7);
  const auto velocity = [&](int i) -> Vec3 { return w.cross(b.position(i)) + b.rate(i); };
  const double direct = 0.5 * b.direct(velocity, velocity).trace();
  const Mat3 S = b.Syy();
  double ours = 0.5 * w.dot(S.trace() * w - S * w);
  for (int i = 0; i < 4; ++i) {
    ours += b.q_dot[i] * w.dot(axial(b.C(i)));
    for (int j = 0; j < 4; ++j)
      ours += 0.5 * b.q_dot[i] * b.q_dot[j] * b.integrals.B[4 * i + j].trace();
  }
  EXPECT_NEAR(ours, direct, kRoundOff * direct);
}

TEST_P(MomentumIntegralsOf, ReproduceTheModalFictitiousForce) {
  const Body b(GetParam());
  const Vec3 w(1.0, 2.0, -0.7);
  const Mat3 W = cross_matrix(w) * cross_matrix(w);
  const auto acceleration = [&](int i) -> Vec3 {
    return W * b.position(i) + 2.0 * w.cross(b.rate(i));
  };
  for (int i = 0; i < 4; ++i) {
    const auto mode = [&](int k) -> Vec3 { return b.modes.col(i).segment<3>(3 * k); };
    const double direct = b.direct(mode, acceleration).trace();
    Mat3 Bq_dot = Mat3::Zero();
    for (int j = 0; j < 4; ++j) Bq_dot += b.q_dot[j] * b.integrals.B[4 * i + j];
    const double ours = (W * b.C(i)).trace() + 2.0 * (cross_matrix(w) * Bq_dot.transpose()).trace();
    EXPECT_NEAR(ours, direct, kRoundOff * b.direct(acceleration, acceleration).norm());
  }
}

INSTANTIATE_TEST_SUITE_P(EachMass, MomentumIntegralsOf,
                         ::testing::Values(MassKind::kConsistent, MassKind::kLumped));

TEST(MomentumIntegrals, OfARigidBodyAreItsMassAndSecondMoment) {
  TetMesh mesh = shapes::tet_box(2, 3, 4, 0.5);  // 1 x 1.5 x 2 m
  move_to_centre_of_mass(mesh);
  const MomentumIntegrals rest = momentum_integrals(
      mesh.nodes, mass_matrix(mesh, Material{2.0, 1.0, 0.0}, MassKind::kConsistent),
      MatX(3 * 60, 0));
  EXPECT_NEAR(rest.mass, 6.0, 1e-13);
  const Mat3 exact = (6.0 / 12.0 * Vec3(1.0, 2.25, 4.0)).asDiagonal();  // m/12 L_a^2
  EXPECT_LT((rest.Sxx - exact).norm(), 1e-13);
  EXPECT_TRUE(rest.A.empty() && rest.B.empty() && rest.I3.empty());
}

}  // namespace
}  // namespace archetide
