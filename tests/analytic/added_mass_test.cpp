#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// m_a / (rho 4/3 pi a^3) of a sphere at the centre of a cube of half width 2 a: converged spectral
// values.
constexpr double kClosedCube = 0.6228265974, kOpenTop = 0.6139968114;

ReducedBody rigid_sphere(double radius, double density) {
  return make_body(rigid_surface_archetype(volume_true_sphere(5, radius), density), 0);
}

// A sphere of radius 1 set moving along z in still water: m v* = (m + m_a) v.
double added_mass_coefficient(int cells_per_radius, Geometry geometry) {
  CoupledTank tank(4 * cells_per_radius, 2.0);
  tank.options.geometry = geometry;
  tank.bodies.push_back(rigid_sphere(1.0, 1000.0));
  const double mass = tank.bodies[0].archetype->integrals.mass;
  tank.bodies[0].P = Vec3(0, 0, mass);
  EXPECT_TRUE(tank.solve(0.01).converged);
  return 1.0 / tank.results[0].y[2] - 1.0;  // density ratio 1
}

TEST(AddedMass, CutCellSphereInClosedCubeConvergesAtSecondOrder) {
  const double e4 = added_mass_coefficient(4, Geometry::kCutCell) / kClosedCube - 1.0;
  const double e8 = added_mass_coefficient(8, Geometry::kCutCell) / kClosedCube - 1.0;
  const double voxel4 = added_mass_coefficient(4, Geometry::kVoxel) / kClosedCube - 1.0;
  const double voxel8 = added_mass_coefficient(8, Geometry::kVoxel) / kClosedCube - 1.0;
  const double order = std::log2(std::abs(e4 / e8));
  std::printf("cells per radius   cut cell     voxel\n");
  std::printf("               4   %+8.4f %%   %+7.2f %%\n", 100 * e4, 100 * voxel4);
  std::printf("               8   %+8.4f %%   %+7.2f %%   order %.2f\n", 100 * e8, 100 * voxel8,
              order);
  EXPECT_LT(std::abs(e4), 3e-3);
  EXPECT_LT(std::abs(e8), 3e-3 / 8);
  EXPECT_GT(order, 1.7);
}

// a/g = (1 - s) / (s + k) in the first instant; open top, density ratio s = 0.5.
TEST(AddedMass, ReleasedSphereUnderOpenTopAcceleratesAsInPotentialFlow) {
  const int n = 16;
  CoupledTank tank(n, 2.0);
  tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
  tank.options.open_side[kZMax] = true;
  tank.bodies.push_back(rigid_sphere(1.0, 500.0));
  const double dt = 1e-3;
  ASSERT_TRUE(tank.solve(dt).converged);
  const double a = tank.results[0].y[2] / dt, exact = 9.81 * 0.5 / (0.5 + kOpenTop);
  std::printf("acceleration %.6f, exact %.6f, error %+.3f %%\n", a, exact, 100 * (a / exact - 1));
  EXPECT_NEAR(a / exact, 1.0, 3e-3);
}

}  // namespace
}  // namespace archetide
