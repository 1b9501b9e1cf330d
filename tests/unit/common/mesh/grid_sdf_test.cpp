#include "common/mesh/grid_sdf.h"

#include <gtest/gtest.h>

#include <cmath>

namespace archetide {
namespace {

/// Samples f on 5 x 6 x 7 nodes of spacing 0.5 from (-1, -1, -1).
template <class F>
GridSdf sampled(const F& f) {
  GridSdf grid;
  grid.origin = Vec3(-1, -1, -1);
  grid.spacing = 0.5;
  grid.nodes = Vec3i(5, 6, 7);
  for (int k = 0; k < 7; ++k) {
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 5; ++i) {
        grid.values.push_back(static_cast<float>(f(grid.origin + 0.5 * Vec3(i, j, k))));
      }
    }
  }
  return grid;
}

TEST(GridSdf, ReproducesATrilinearFunctionAndItsGradient) {
  const auto f = [](const Vec3& x) { return 1 + x[0] - 2 * x[1] + x[2] + x[0] * x[1] * x[2]; };
  const GridSdf grid = sampled(f);
  for (const Vec3& x :
       {Vec3(0.1, 0.2, 0.3), Vec3(-1, -1, -1), Vec3(1, 1.5, 2), Vec3(-0.7, 1.4, 1.9)}) {
    // Floats hold 2^-24 of values up to 8: 5e-7 (measured 1e-7).
    EXPECT_NEAR(grid.value(x), f(x), 1e-6);
    const Vec3 slope(1 + x[1] * x[2], -2 + x[0] * x[2], 1 + x[0] * x[1]);
    EXPECT_LT((grid.gradient(x) - slope).norm(), 1e-5);
  }
}

TEST(GridSdf, GrowsByTheDistanceToItsBoxOutside) {
  const GridSdf grid = sampled([](const Vec3& x) { return x.norm(); });
  EXPECT_NEAR(grid.value(Vec3(1, 1.5, 2) + Vec3(3, 4, 12)), Vec3(1, 1.5, 2).norm() + 13.0, 1e-6);
  EXPECT_NEAR(grid.value(Vec3(-3, 0, 0)), 1.0 + 2.0, 1e-6);
}

TEST(GridSdf, GradientIsTheSlopeOfTheValueAlsoOutside) {
  const GridSdf grid = sampled([](const Vec3& x) { return x.norm() - 0.6; });
  const double h = 1e-6;
  for (const Vec3& x :
       {Vec3(0.3, 0.4, 0.1), Vec3(-3.1, 0.2, 0.3), Vec3(2.2, 3.3, 0.1), Vec3(4, 5, 6)}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 e = h * Vec3::Unit(axis);
      const double slope = (grid.value(x + e) - grid.value(x - e)) / (2 * h);
      EXPECT_NEAR(grid.gradient(x)[axis], slope, 1e-8) << x.transpose();
    }
  }
}

TEST(GridSdf, AnEmptyGridIsFarFromEverything) {
  const GridSdf grid;
  EXPECT_EQ(grid.value(Vec3(1, 2, 3)), std::numeric_limits<double>::infinity());
  EXPECT_EQ(grid.gradient(Vec3(1, 2, 3)), Vec3::Zero());
}

}  // namespace
}  // namespace archetide
