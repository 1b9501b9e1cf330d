// What the integrals give against sums over all particles with dense matrices.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "runtime/solid/rotation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

/// Dense objects of one configuration over the n nodes, world frame.
struct Dense {
  MatX M;   // 3n x 3n
  MatX J;   // 3n x 6, J_rigid
  MatX RS;  // 3n x r
  MatX B;   // 3n x r, P_dᵀ R S
  MatX M_rigid;
};

MatX expand(const MatX& scalar) {
  MatX M = MatX::Zero(3 * scalar.rows(), 3 * scalar.cols());
  for (long i = 0; i < scalar.rows(); ++i)
    for (long j = 0; j < scalar.cols(); ++j)
      M.block<3, 3>(3 * i, 3 * j) = scalar(i, j) * Mat3::Identity();
  return M;
}

Dense dense(const SyntheticBody& synthetic, const ReducedBody& body) {
  const long n = static_cast<long>(synthetic.nodes().size());
  const Mat3 R = body.rotation.toRotationMatrix();
  const MatX S = synthetic.archetype->node_modes.leftCols(body.r);
  const VecX u = S * body.q;
  Dense d{
      body.mass_scale * expand(synthetic.scalar_mass), MatX(3 * n, 6), MatX(3 * n, body.r), {}, {}};
  for (long v = 0; v < n; ++v) {
    const Vec3 arm = R * (synthetic.nodes()[v] + u.segment<3>(3 * v));
    d.J.middleRows<3>(3 * v) << Mat3::Identity(), -skew(arm);
    d.RS.middleRows<3>(3 * v) = R * S.middleRows<3>(3 * v);
  }
  d.M_rigid = d.J.transpose() * d.M * d.J;
  d.B = d.RS - d.J * d.M_rigid.ldlt().solve(d.J.transpose() * d.M * d.RS);
  return d;
}

/// A body in a state without any symmetry: modes displaced by about a tenth of its size.
struct Integrals : ::testing::TestWithParam<int> {
  SyntheticBody synthetic = linear_alone(random_archetype(7, 6));
  ReducedBody body = make_body(synthetic.archetype, GetParam());
  void SetUp() override {
    std::srand(3);
    body.mass_scale = 1.7;
    body.rotation = Quat(0.3, -0.5, 0.7, 0.2).normalized();
    body.position = Vec3(1, -2, 3);
    body.q = 0.2 * VecX::Random(body.r);
    body.q_dot = 5.0 * VecX::Random(body.r);
    body.P = Vec3(10, -20, 5);
    body.L = Vec3(3, 1, -2);
  }
  Configuration here() const { return current_configuration(body); }
};

// Round-off of sums over 80 nodes relative to the result; measured at most 3e-15.
constexpr double kSumRoundOff = 1e-12;

/// `scale`: size of the terms whose sum b is (a single mode has D = 0, a sum of cancelling terms).
void expect_close(const MatX& a, const MatX& b, double scale) {
  ASSERT_EQ(a.rows(), b.rows());
  ASSERT_EQ(a.cols(), b.cols());
  EXPECT_LE((a - b).norm(), kSumRoundOff * scale);
}
void expect_close(const MatX& a, const MatX& b) { expect_close(a, b, b.norm()); }

TEST_P(Integrals, GiveTheGeneralisedMassOfTheParticles) {
  const Dense d = dense(synthetic, body);
  const ConfigurationTerms t = configuration_terms(body, here(), ModalMass::kExact);
  EXPECT_NEAR(t.mass, d.M_rigid(0, 0), kSumRoundOff * t.mass);
  expect_close(t.inertia, d.M_rigid.bottomRightCorner<3, 3>());
  expect_close(t.inertia_inverse * t.inertia, Mat3::Identity());
  expect_close(t.D, (d.J.transpose() * d.M * d.RS).bottomRows<3>(), t.inertia.norm());
  expect_close(t.M_q, d.B.transpose() * d.M * d.B);
  expect_close(configuration_terms(body, here(), ModalMass::kPaper).M_q,
               d.RS.transpose() * d.M * d.RS);
}

TEST_P(Integrals, GiveTheFictitiousForceOfTheParticles) {
  const Dense d = dense(synthetic, body);
  const ConfigurationTerms t = configuration_terms(body, here(), ModalMass::kExact);
  // frame spin from the dense momentum map: M_rigid (v, ω) = (P, L) − Jᵀ M R S q̇
  VecX momentum(6);
  momentum << body.P, body.L;
  const VecX frame = d.M_rigid.ldlt().solve(momentum - d.J.transpose() * d.M * d.RS * body.q_dot);
  expect_close(frame_spin(t, body.L, body.q_dot), frame.tail<3>());

  const Vec3 w = frame.tail<3>();
  const VecX u_dot = d.RS * body.q_dot;
  VecX a(d.J.rows());
  for (long v = 0; v < a.size() / 3; ++v) {
    // row block of J is [1, −[r]×]
    const Mat3 minus_cross = d.J.block<3, 3>(3 * v, 3);
    const Vec3 arm(minus_cross(1, 2), minus_cross(2, 0), minus_cross(0, 1));
    a.segment<3>(3 * v) = -w.cross(w.cross(arm)) - 2.0 * w.cross(Vec3(u_dot.segment<3>(3 * v)));
  }
  expect_close(fictitious_force(body, here(), t), d.B.transpose() * (d.M * a));
}

TEST_P(Integrals, GiveMomentaAndKineticEnergyOfTheParticles) {
  const Dense d = dense(synthetic, body);
  VecX momentum(6);
  momentum << body.P, body.L;
  const VecX v = d.J * d.M_rigid.ldlt().solve(momentum) + d.B * body.q_dot;
  expect_close(d.J.transpose() * d.M * v, momentum);
  const double energy = 0.5 * v.dot(d.M * v);
  EXPECT_NEAR(kinetic_energy(body), energy, kSumRoundOff * energy);
  EXPECT_NEAR(elastic_energy(body),
              0.5 * body.q.cwiseAbs2().dot(synthetic.archetype->omega2.head(body.r)),
              kSumRoundOff * (1e-300 + elastic_energy(body)));

  // velocities of the surface are those of its nodes
  const ConfigurationTerms t = configuration_terms(body, here(), ModalMass::kExact);
  for (int s : {0, 5, 11}) {
    const int node = synthetic.archetype->surface_to_node[s];
    expect_close(surface_velocity(body, t, s), v.segment<3>(3 * node));
  }
}

// The impulse factor of Eq. 43, with the projections written out, on the surface nodes.
TEST_P(Integrals, ImpulsesMeetTheImpulseFactorOfThePaper) {
  const Dense d = dense(synthetic, body);
  const ConfigurationTerms t = configuration_terms(body, here(), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, t, 0.01, Stage::kVelocityFull, ModalStep::kBackwardEuler);
  const MatX P_rigid = d.M * d.J * d.M_rigid.ldlt().solve(d.J.transpose());
  const MatX P_d = MatX::Identity(d.M.rows(), d.M.rows()) - P_rigid;
  MatX K_lambda = P_rigid.transpose() * d.M.ldlt().solve(P_rigid);
  if (body.r > 0) K_lambda += P_d.transpose() * d.RS * H.M_hat.ldlt().solve(d.RS.transpose() * P_d);

  const std::vector<int>& node = synthetic.archetype->surface_to_node;
  for (int a : {0, 7, 20})
    for (int b : {3, 7}) {
      const MatX J_a = point_jacobian(body, t, a), J_b = point_jacobian(body, t, b);
      MatX response(J_a.cols(), 3);
      for (int axis = 0; axis < 3; ++axis) response.col(axis) = H.solve(J_b.row(axis).transpose());
      expect_close(J_a * response, K_lambda.block<3, 3>(3 * node[a], 3 * node[b]));
    }
}

TEST_P(Integrals, ApplyAndSolveAreInverse) {
  const ConfigurationTerms t = configuration_terms(body, here(), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, t, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  const VecX y = VecX::Random(body.dofs());
  expect_close(H.solve(H.apply(y)), y);
}

// Fewer modes than the archetype holds, all of them, and none.
INSTANTIATE_TEST_SUITE_P(Modes, Integrals, ::testing::Values(0, 1, 4, 6));

TEST(Surface, PointsAgreeOneByOneAndAtOnce) {
  const SyntheticBody synthetic = random_archetype(2, 5);
  ReducedBody body = make_body(synthetic.archetype, 3);
  body.position = Vec3(0.3, 0.2, 5.0);
  body.rotation = Quat(0.9, 0.1, -0.4, 0.2).normalized();
  body.q = Vec3(0.1, -0.2, 0.05);
  std::vector<Vec3> points;
  surface_points(body, points);
  ASSERT_EQ(points.size(), synthetic.archetype->surface.vertices.size());
  for (std::size_t v = 0; v < points.size(); ++v)
    EXPECT_LE((points[v] - surface_point(body, static_cast<int>(v))).norm(), 1e-14);
}

TEST(Surface, VelocityIsTheRateOfThePointAsThePoseAdvances) {
  const SyntheticBody synthetic = random_archetype(2, 5);
  ReducedBody body = make_body(synthetic.archetype, 5);
  body.q = 0.05 * VecX::Ones(5);
  body.q_dot = VecX::LinSpaced(5, -1.0, 1.0);
  body.P = Vec3(20, 10, 0);
  body.L = Vec3(1, 2, 3);
  const FreeMotion start = free_motion(body, current_configuration(body), VecX::Zero(11), 0.0,
                                       Stage::kPositionHalf, ModalOptions{});
  const Vec3 v = surface_velocity(body, start.terms, 9);
  // central difference over dt 1e-4: error dt² x‴ / 24, measured 3e-9
  constexpr double dt = 1e-4;
  ReducedBody before = body, after = body;
  advance_pose(after, start, start.y_star, 0.5 * dt);
  advance_pose(before, start, start.y_star, -0.5 * dt);
  EXPECT_LE(((surface_point(after, 9) - surface_point(before, 9)) / dt - v).norm(), 1e-7);
}

TEST(Instance, OwnsAtMost16KiBWithTwentyModes) {
  const SyntheticBody synthetic = random_archetype(2, 20);
  const ReducedBody body = make_body(synthetic.archetype, 20);
  EXPECT_LE(instance_bytes(body), 16u * 1024u);  // measured 784 bytes
  EXPECT_GE(instance_bytes(body), 40u * sizeof(double));
}

}  // namespace
}  // namespace archetide
