// How far modes may go before an element turns inside out.
#include "runtime/solid/inversion_limit.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <random>

#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kLeast = InversionLimit::kLeastVolume, kMost = InversionLimit::kLargestGradient;

/// The same tets with a node in the middle of every edge.
TetMesh with_middles(TetMesh mesh) {
  std::map<std::pair<int, int>, int> middle;
  for (const auto& tet : mesh.tets) {
    mesh.mids.emplace_back();
    for (int e = 0; e < 6; ++e) {
      const auto [p, q] = std::minmax(tet[kTetEdges[e][0]], tet[kTetEdges[e][1]]);
      const auto [at, fresh] = middle.try_emplace({p, q}, static_cast<int>(mesh.nodes.size()));
      if (fresh) mesh.nodes.emplace_back(0.5 * (mesh.nodes[p] + mesh.nodes[q]));
      mesh.mids.back()[e] = at->second;
    }
  }
  return mesh;
}

/// What the limit looks at: tets, and a node field per mode.
Archetype shape_with(const TetMesh& tets, int r,
                     const std::function<Vec3(int, const Vec3&)>& mode) {
  Archetype a;
  a.tets = tets;
  a.node_modes.resize(3 * static_cast<long>(tets.nodes.size()), r);
  for (int i = 0; i < r; ++i)
    for (std::size_t v = 0; v < tets.nodes.size(); ++v)
      a.node_modes.block<3, 1>(3 * static_cast<long>(v), i) = mode(i, tets.nodes[v]);
  return a;
}

/// Random fields of degree 2 in the coordinates, gradients of about 1.
Archetype random_shape(const TetMesh& tets, int r) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Matrix<double, 3, 6>> c(r);
  for (auto& m : c) m = Eigen::Matrix<double, 3, 6>::NullaryExpr([&] { return normal(random); });
  return shape_with(tets, r, [&](int i, const Vec3& x) {
    Eigen::Matrix<double, 6, 1> monomials;
    monomials << x, x[0] * x[1] / 0.2, x[1] * x[2] / 0.2, x[0] * x[2] / 0.2;
    return Vec3(c[i] * monomials);
  });
}

class BothOrders : public testing::TestWithParam<int> {
 protected:
  TetMesh tets() const {
    const TetMesh linear = blob_tets(5, Vec3(0.5, 0.4, 0.3), Vec3i(3, 3, 2));
    return GetParam() == 1 ? linear : with_middles(linear);
  }
};
INSTANTIATE_TEST_SUITE_P(Inversion, BothOrders, testing::Values(1, 2));

// F = (1 + q) 1 everywhere: (1 - s |q|)^3 = 0.1.
TEST_P(BothOrders, UniformCompressionStopsAtATenthOfTheVolume) {
  const Archetype a = shape_with(tets(), 1, [](int, const Vec3& x) { return x; });
  const InversionLimit limit(a);
  const double edge = 1.0 - std::cbrt(kLeast);
  for (const double q : {-0.6, -0.9, -1.0, -3.0, -1e6})
    EXPECT_NEAR(limit.allowed_share(VecX::Constant(1, q)) * -q, edge, 1e-14) << q;
  EXPECT_EQ(limit.allowed_share(VecX::Constant(1, -0.3)), 1.0);
  EXPECT_EQ(limit.allowed_share(VecX::Constant(1, 2.3)), 1.0);  // grows, |grad| = 2.3 sqrt(3)
  EXPECT_NEAR(limit.least_volume(VecX::Constant(1, -0.5)), 0.125, 1e-14);
  EXPECT_EQ(limit.allowed_share(VecX::Constant(1, NAN)), 1.0);  // not this guard's business
}

// Drawn along one axis, |grad| = q; turned by straight displacements, |grad| = sqrt(2) q.
TEST_P(BothOrders, StretchesAndTurnsStopAtTheLargestGradient) {
  const Archetype drawn =
      shape_with(tets(), 1, [](int, const Vec3& x) { return Vec3(x[0], 0, 0); });
  const Archetype turned =
      shape_with(tets(), 1, [](int, const Vec3& x) { return Vec3(-x[1], x[0], 0.0); });
  for (const double q : {6.0, 20.0, 1e6}) {
    EXPECT_NEAR(InversionLimit(drawn).allowed_share(VecX::Constant(1, q)) * q, kMost, 1e-12);
    EXPECT_NEAR(InversionLimit(turned).allowed_share(VecX::Constant(1, q)) * q,
                kMost / std::sqrt(2.0), 1e-12);
  }
  EXPECT_NEAR(InversionLimit(drawn).largest_gradient(VecX::Constant(1, 1.5)), 1.5, 1e-14);
}

// A half turn of 180 degrees by two flips has a positive volume again, but the way there does not.
TEST_P(BothOrders, WayThroughAFlipIsNotAllowed) {
  const Archetype a =
      shape_with(tets(), 1, [](int, const Vec3& x) { return Vec3(-x[0], -x[1], 0.0); });
  const InversionLimit limit(a);
  const VecX turned = VecX::Constant(1, 2.0);
  EXPECT_NEAR(limit.least_volume(turned), 1.0, 1e-12);
  // (1 - s q)^2 = 0.1
  EXPECT_NEAR(limit.allowed_share(turned), 0.5 * (1.0 - std::sqrt(kLeast)), 1e-14);
}

TEST_P(BothOrders, AllowedShareIsTheFirstPlaceOnTheWayWhereAnElementMeetsALimit) {
  constexpr int kModes = 5;
  const Archetype a = random_shape(tets(), kModes);
  const InversionLimit limit(a);
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  int sure = 0, stopped = 0;
  for (int n = 0; n < 300; ++n) {
    const VecX q =
        3.0 * std::pow(n / 300.0, 3) * VecX::NullaryExpr(kModes, [&] { return normal(random); });
    const double share = limit.allowed_share(q);
    for (int k = 1; k <= 20; ++k) {
      EXPECT_GE(limit.least_volume(share * k / 20.0 * q), kLeast - 1e-12);
      EXPECT_LE(limit.largest_gradient(share * k / 20.0 * q), kMost + 1e-12);
    }
    sure += limit.surely_holds(q);
    if (share == 1.0) continue;
    ++stopped;
    EXPECT_FALSE(limit.surely_holds(q));
    EXPECT_LT(std::min(std::abs(limit.least_volume(share * q) - kLeast),
                       std::abs(limit.largest_gradient(share * q) - kMost)),
              1e-12);
  }
  EXPECT_GT(sure, 50);
  EXPECT_GT(stopped, 50);
}

// Fewer modes in use than are stored: the others do not count.
TEST_P(BothOrders, ModesThatAreNotInUseDoNotMatter) {
  const Archetype a = random_shape(tets(), 5);
  Archetype fewer = a;
  fewer.node_modes.conservativeResize(Eigen::NoChange, 2);
  const VecX q = Eigen::Vector2d(1.5, -0.8);
  EXPECT_EQ(InversionLimit(a).allowed_share(q), InversionLimit(fewer).allowed_share(q));
}

TEST_P(BothOrders, StoppingTakesEnergyAndClosesNothingAnyMore) {
  constexpr int kModes = 5;
  const Archetype a = random_shape(tets(), kModes);
  const InversionLimit limit(a);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int n = 0; n < 50; ++n) {
    const auto draw = [&] { return normal(random); };
    VecX q = 5.0 * VecX::NullaryExpr(kModes, draw);
    q *= limit.allowed_share(q);
    const MatX half = MatX::NullaryExpr(kModes, kModes, draw);
    const MatX M = half * half.transpose() + MatX::Identity(kModes, kModes);
    const VecX before = VecX::NullaryExpr(kModes, draw);
    VecX after = before;
    limit.stop_closing(q, M, after);
    EXPECT_LE(after.dot(M * after), before.dot(M * before) * (1.0 + 1e-14));
    // what closes would show at first order, 1e-6 of rates of about 1
    constexpr double kStep = 1e-6;
    EXPECT_GE(limit.least_volume(q + kStep * after), kLeast - 1e-10);
    EXPECT_LE(limit.largest_gradient(q + kStep * after), kMost + 1e-9);
    // opening is left alone to the last bit
    VecX opening = -q;
    limit.stop_closing(q, M, opening);
    if (limit.least_volume((1.0 - kStep) * q) > kLeast + 0.5e-6 ||
        limit.largest_gradient((1.0 - kStep) * q) < kMost - 0.5e-6) {
      EXPECT_EQ(opening, VecX(-q));
    }
  }
}

TEST(Inversion, NothingToLimitWithoutTets) {
  Archetype a;
  a.node_modes.resize(0, 0);
  const InversionLimit limit(a);
  EXPECT_EQ(limit.allowed_share(VecX::Constant(3, 1e9)), 1.0);
  EXPECT_EQ(limit.least_volume(VecX::Constant(3, 1e9)), 1.0);
}

}  // namespace
}  // namespace archetide
