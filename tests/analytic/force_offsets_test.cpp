#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/single_solve_cases.h"

namespace archetide {
namespace {

const char* name_of(TestShape shape) {
  return shape == TestShape::kSphere ? "sphere, 4 cells per radius" : "cube, 8.3 cells";
}

TEST(ForceOffsets, BuoyancyIsExactAtAnySubCellPosition) {
  for (const double level : {0.0, 8.3})  // crossing the surface; submerged
    for (const TestShape shape : {TestShape::kSphere, TestShape::kCube}) {
      const OffsetErrors e = buoyancy_over_offsets(shape, level, 100);
      std::printf("%s, %s: buoyancy error rms %.2e, worst %.2e\n", name_of(shape),
                  level == 0.0 ? "at the surface" : "submerged", e.rms, e.worst);
      EXPECT_LT(e.rms, 2e-3);
    }
}

TEST(ForceOffsets, BuoyancyDoesNotJumpWhileABodyCrossesTheSurface) {
  for (const TestShape shape : {TestShape::kSphere, TestShape::kCube}) {
    const auto body = test_shape(shape);
    const double half = shape == TestShape::kSphere ? 4.0 : 8.3 / 2;  // m
    double last = 0.0, jump = 0.0;
    for (int n = 0; n <= 100; ++n) {
      const double z = half * (1.1 - 2.2 * n / 100);  // from dry to submerged
      const double error = buoyancy(body, Vec3(0.21, 0.37, z), 0.0) - submerged_share(shape, z);
      if (n > 0) jump = std::max(jump, std::abs(error - last));
      last = error;
    }
    std::printf("%s: largest jump %.2e of the displaced weight\n", name_of(shape), jump);
    EXPECT_LT(jump, 0.02);
  }
}

double worst_added_mass_error(int cells_per_radius, int positions, double density_ratio) {
  const OffsetErrors e = added_mass_over_offsets(cells_per_radius, positions, density_ratio);
  std::printf(
      "added mass, %d cells per radius, density ratio %g, %d positions: mean error %+.3f %%, worst "
      "%.3f %%\n",
      cells_per_radius, density_ratio, positions, 100 * e.mean, 100 * e.worst);
  return e.worst;
}

// The two terms of DualFace take out what is of second order, so that 0.3 % is reached at 4 cells
// per radius (without them 4.0 %). What is left is noise of the flux through cut faces, of third
// order: 1/8 of it at 8 cells.
TEST(ForceOffsets, AddedMassIsRightAtAnySubCellPosition) {
  EXPECT_LT(worst_added_mass_error(4, 100, 1.0), 3e-3);
  EXPECT_LT(worst_added_mass_error(8, 5, 1.0), 3e-3 / 8);
}

// A body lighter than the water that its wall takes off: part of that stays on, at most the 3/4
// (dx/a)^2 / 12 of the displaced mass at each pole that the midpoint rule errs by, 1.5 % of the
// added mass.
TEST(ForceOffsets, AddedMassOfALightBodyIsWithinTheMidpointRulesError) {
  EXPECT_LT(worst_added_mass_error(4, 20, 1e-3), 2e-2);
}

}  // namespace
}  // namespace archetide
