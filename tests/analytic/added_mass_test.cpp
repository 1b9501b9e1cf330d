#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/single_solve_cases.h"

namespace archetide {
namespace {

// m_a / (rho 4/3 pi a^3) of a sphere at the centre of a cube of half width 2 a: converged spectral
// values.
constexpr double kClosedCube = 0.6228265974, kOpenTop = 0.6139968114;

double error_in_cube(int cells_per_radius, Geometry geometry) {
  return added_mass_in_cube(cells_per_radius, geometry, false).coefficient / kClosedCube - 1.0;
}

TEST(AddedMass, CutCellSphereInClosedCubeConvergesAtSecondOrder) {
  const double e4 = error_in_cube(4, Geometry::kCutCell), e8 = error_in_cube(8, Geometry::kCutCell);
  const double voxel4 = error_in_cube(4, Geometry::kVoxel),
               voxel8 = error_in_cube(8, Geometry::kVoxel);
  const double order = std::log2(std::abs(e4 / e8));
  std::printf("cells per radius   cut cell     voxel\n");
  std::printf("               4   %+8.4f %%   %+7.2f %%\n", 100 * e4, 100 * voxel4);
  std::printf("               8   %+8.4f %%   %+7.2f %%   order %.2f\n", 100 * e8, 100 * voxel8,
              order);
  EXPECT_LT(std::abs(e4), 3e-3);
  EXPECT_LT(std::abs(e8), 3e-3 / 8);
  EXPECT_GT(order, 1.7);
}

// Ends that lie in the tank's walls to round-off are no walls of the water, on neither side:
// counted on one side alone, pressure spun the cylinder, and 70 % of its added mass was gone.
TEST(AddedMass, CylinderWithEndsFlushWithTheWallsIsThatWithEndsBehindThem) {
  for (const int thickness : {1, 4}) {
    const double flush = added_mass_of_cylinder(8, false, thickness, 0.0).coefficient;
    const double behind = added_mass_of_cylinder(8, false, thickness, 1e-4).coefficient;
    std::printf("%d cells thick: %.5f flush, %.5f behind\n", thickness, flush, behind);
    EXPECT_NEAR(flush / behind, 1.0, 1e-4);
  }
}

// a/g = (1 - s) / (s + k) in the first instant; open top, density ratio s = 0.5.
TEST(AddedMass, ReleasedSphereUnderOpenTopAcceleratesAsInPotentialFlow) {
  const double a = release_acceleration(4), exact = 0.5 / (0.5 + kOpenTop);
  std::printf("acceleration %.6f g, exact %.6f g, error %+.3f %%\n", a, exact,
              100 * (a / exact - 1));
  EXPECT_NEAR(a / exact, 1.0, 3e-3);
}

}  // namespace
}  // namespace archetide
