// The laws that contact impulses obey, checked on random problems.
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/contact/contact_impulses.h"
#include "runtime/contact/nonnegative_least_squares.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

TEST(LeastPushes, AreComplementaryToTheSpeedsOnRandomProblemsOfAnyRank) {
  std::srand(5);
  for (int trial = 0; trial < 300; ++trial) {
    const int m = 1 + trial % 24, rank = 1 + trial % 9;
    const MatX J = MatX::Random(m, rank);
    const MatX A = J * J.transpose();
    // speeds that some motion can give, so that a solution exists
    const VecX b = J * VecX::Random(rank) - VecX::Random(m).cwiseAbs();
    const VecX lambda = nonnegative_least_squares(A, b);
    const VecX spare = A * lambda - b;
    // condition of the active rows times round-off
    const double scale = b.cwiseAbs().maxCoeff();
    EXPECT_GE(lambda.minCoeff(), 0.0);
    EXPECT_GE(spare.minCoeff(), -1e-10 * scale) << "m " << m << " rank " << rank;
    EXPECT_LE(lambda.cwiseProduct(spare).cwiseAbs().maxCoeff(),
              1e-10 * scale * (1.0 + lambda.maxCoeff()));
  }
}

TEST(LeastPushes, AreNoneWhereNothingApproaches) {
  EXPECT_EQ(nonnegative_least_squares(MatX::Identity(3, 3), VecX::Constant(3, -1.0)),
            VecX(VecX::Zero(3)));
  EXPECT_EQ(nonnegative_least_squares(MatX::Identity(3, 3), VecX::Zero(3)), VecX(VecX::Zero(3)));
}

struct Friction : ::testing::TestWithParam<double> {};

TEST_P(Friction, ObeysCoulombsLawOnASoftBody) {
  const double mu = GetParam();
  const SyntheticBody synthetic = random_archetype(8, 6);
  const ReducedBody body = make_body(synthetic.archetype, 6);
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, terms, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  std::vector<ContactPoint> points;
  for (int v : {0, 2, 9, 14}) points.push_back({v, Vec3::UnitZ(), 0.0});
  const MatX N = contact_rows(body, terms, points), T = tangent_rows(body, terms, points);
  VecX y = VecX::LinSpaced(body.dofs(), -1.0, 1.0);
  y.head<3>() = Vec3(1.5, -0.5, -1.0);
  const VecX before = y;
  const ContactImpulses impulses = push_apart(H, N, T, VecX::Zero(4), mu, y);

  const VecX change = y - before - H.solve(generalised_impulse(N, T, impulses));
  EXPECT_LE(change.norm(), 1e-12);
  int sliding = 0;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d rub = impulses.tangent.segment<2>(2 * k),
                          slip = T.middleRows<2>(2 * k) * y;
    const double push = impulses.normal[k], separating = N.row(k).dot(y);
    EXPECT_GE(push, 0.0);
    EXPECT_GE(separating, -1e-12);
    EXPECT_LE(push * separating, 1e-10);
    EXPECT_LE(rub.norm(), mu * push * (1 + 1e-12));
    // sticks, or the friction is at its bound and against the slip
    if (slip.norm() < 1e-10 || push == 0.0) continue;
    ++sliding;
    EXPECT_NEAR(rub.norm(), mu * push, 1e-10 * push);
    EXPECT_NEAR(rub.dot(slip), -rub.norm() * slip.norm(), 1e-9 * push);
  }
  if (mu < 0.5) {
    EXPECT_GT(sliding, 0);
  }
  // friction and inelastic contact only take energy
  EXPECT_LT(y.dot(H.apply(y)), before.dot(H.apply(before)));
}
INSTANTIATE_TEST_SUITE_P(Coefficients, Friction, ::testing::Values(0.1, 0.4, 2.0));

}  // namespace
}  // namespace archetide
