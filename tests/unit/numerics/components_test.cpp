#include "runtime/numerics/components.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "runtime/numerics/poisson_operator.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

ClosedComponents components_of(const PoissonMatrix& a) {
  ClosedComponents closed;
  closed.setup(a);
  return closed;
}

// A full tank of 6 x 5 x 4 cells with all faces open between cells.
PoissonMatrix full_tank() { return make_matrix({6, 5, 4, 2.0}); }

TEST(ClosedComponents, FullTankIsOne) {
  const PoissonMatrix a = full_tank();
  const ClosedComponents closed = components_of(a);
  ASSERT_EQ(closed.count(), 1u);
  EXPECT_EQ(closed.size(0), a.size());
}

TEST(ClosedComponents, NoneUnderAirOrAtAnOpenSide) {
  EXPECT_TRUE(components_of(make_matrix({6, 5, 4, 0.5})).empty());
  for (int side = 0; side < 6; ++side) {
    Tank tank{6, 5, 4, 2.0};
    tank.open_side[side] = true;
    EXPECT_TRUE(components_of(make_matrix(tank)).empty()) << side;
  }
}

TEST(ClosedComponents, NoneWithoutWater) {
  EXPECT_TRUE(components_of(make_matrix({6, 5, 4, -1.0})).empty());
  EXPECT_TRUE(components_of(PoissonMatrix()).empty());
}

TEST(ClosedComponents, AClosedWallSeparatesAndASliverJoins) {
  PoissonMatrix a = full_tank();
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j) a.w[0](3, j, k) = 0.0;
  EXPECT_EQ(components_of(a).count(), 2u);
  a.w[0](3, 2, 2) = 1e-6;
  EXPECT_EQ(components_of(a).count(), 1u);
}

TEST(ClosedComponents, OpenPartsAreThoseOfPartedWater) {
  PoissonMatrix a = make_matrix({6, 5, 4, 0.5});
  EXPECT_TRUE(components_of(a).open_parts().empty());
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j) a.w[0](2, j, k) = 0.0;
  const ClosedComponents two = components_of(a);
  EXPECT_TRUE(two.empty());
  ASSERT_EQ(two.open_parts().size(), 2u);
  const std::size_t layers = two.open_parts()[0].entries / (2 * 5);
  EXPECT_GT(layers, 0u);
  EXPECT_EQ(two.open_parts()[0].entries, 2 * 5 * layers);
  EXPECT_EQ(two.open_parts()[1].entries, 4 * 5 * layers);
}

TEST(ClosedComponents, AirBehindClosedFacesDoesNotOpen) {
  PoissonMatrix a = full_tank();
  a.kind(2, 2, 2) = CellKind::kDirichlet;
  EXPECT_TRUE(components_of(a).empty());
  for (int axis = 0; axis < 3; ++axis) {
    a.w[axis](2, 2, 2) = 0.0;
    a.w[axis](2 + (axis == 0), 2 + (axis == 1), 2 + (axis == 2)) = 0.0;
  }
  ASSERT_EQ(components_of(a).count(), 1u);
  EXPECT_EQ(components_of(a).size(0), a.size() - 1);
}

// The indicator of every closed component is in the null space, and there are as many as the dense
// matrix has zero eigenvalues.
TEST(ClosedComponents, IndicatorsSpanTheNullSpace) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    PoissonMatrix a = random_matrix(6, 4, 5, seed);
    std::mt19937 random(seed);
    for (auto& component : a.w.axis)
      for (std::size_t n = 0; n < component.size(); ++n)
        if (random() % 2 == 0) component[n] = 0.0;
    sum_diagonal(a, [](int, const Vec3i&, const Vec3i&) { return 0.7; });
    const ClosedComponents closed = components_of(a);
    for (std::size_t c = 0; c < closed.count(); ++c) {
      std::vector<double> one(a.size(), 0.0), y(a.size());
      closed.add_constant(c, 1.0, one.data());
      a.apply(one.data(), y.data());
      EXPECT_LT(max_abs(all_blocks(a.size()), y.data()), 1e-15 * 6.0);
    }
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(dense_matrix(a), Eigen::EigenvaluesOnly);
    EXPECT_EQ((eigen.eigenvalues().array() < 1e-12).count(), static_cast<long>(closed.count()));
  }
}

TEST(ClosedComponents, ProjectionLeavesZeroMeanAndIsIdempotent) {
  const PoissonMatrix a = full_tank();
  const ClosedComponents closed = components_of(a);
  std::vector<double> v(a.size(), 3.0);
  v[17] = 5.0;
  closed.project(v.data());
  EXPECT_NEAR(closed.mean(0, v.data()), 0.0, 1e-15);
  const std::vector<double> once = v;
  closed.project(v.data());
  for (std::size_t n = 0; n < v.size(); ++n) EXPECT_NEAR(v[n], once[n], 1e-15);
}

}  // namespace
}  // namespace archetide::testing
