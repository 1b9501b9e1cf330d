// Anderson acceleration of fixed points.
#include "runtime/articulation/anderson.h"

#include <gtest/gtest.h>

namespace archetide {
namespace {

// A linear fixed point x = A x + b in n dimensions whose plain iteration diverges: with depth n the
// accelerated one is GMRES, exact after n + 1 evaluations [WN11].
TEST(Anderson, SolvesALinearProblemInAsManyTurnsAsItHasUnknowns) {
  constexpr int n = 5;
  std::srand(4);
  const MatX A = 2.0 * MatX::Random(n, n);
  const VecX b = VecX::Random(n);
  Anderson faster(n);
  VecX x = VecX::Zero(n);
  for (int turn = 0; turn < n + 1; ++turn) x += faster.step(x, A * x + b - x);
  EXPECT_LE((A * x + b - x).norm(), 1e-10 * b.norm());
}

TEST(Anderson, ConvergesFasterThanThePlainIteration) {
  // x = cos x in every component, and coupled: the plain iteration gains 0.67 a turn
  const auto residual = [](const VecX& x) { return VecX(x.reverse().array().cos().matrix() - x); };
  Anderson faster(3);
  VecX x = VecX::Zero(4), plain = x;
  for (int turn = 0; turn < 8; ++turn) {
    x += faster.step(x, residual(x));
    plain += residual(plain);
  }
  EXPECT_LE(residual(x).norm(), 1e-3 * residual(plain).norm());
  EXPECT_NEAR(x[0], 0.7390851332151607, 1e-4);  // the Dottie number
}

TEST(Anderson, StandsStillAtTheSolution) {
  Anderson faster(3);
  const VecX zero = VecX::Zero(3);
  EXPECT_TRUE(faster.step(VecX::Ones(3), zero).isZero(0.0));
  EXPECT_TRUE(faster.step(VecX::Ones(3), zero).isZero(0.0));
}

}  // namespace
}  // namespace archetide
