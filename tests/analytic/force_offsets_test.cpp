#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kRadius = 4.0, kHalfSide = 8.3 / 2;  // cells
constexpr double kHeavy = 1e9;                        // density ratio of a body that is held

// Low-discrepancy sub-cell offsets [Roberts 2018, R3 sequence], in [-1/2, 1/2).
Vec3 offset(int n) {
  const Vec3 a(0.8191725, 0.6710436, 0.5497005);
  return (n * a).unaryExpr([](double x) { return x - std::floor(x) - 0.5; });
}

// A tank of n^3 cells of 1 m around the origin, water below `level`, open above.
CoupledTank open_tank(int n, double level) {
  CoupledTank tank(n, 0.5 * n);
  Grid& g = tank.options.grid;
  tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
  tank.options.open_side[kZMax] = true;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) tank.phi(i, j, k) = g.cell_centre(i, j, k)[2] - level;
  return tank;
}

// Upward force of still water on a held body at x, in units of the weight of water that its whole
// volume displaces.
double buoyancy(const std::shared_ptr<const Archetype>& archetype, const Vec3& x, double level) {
  CoupledTank tank = open_tank(20, level);
  ReducedBody body = make_body(archetype, 0);
  body.mass_scale = kHeavy;
  body.position = x;
  const double dt = 1e-3;
  body.P = Vec3(0, 0, 9.81 * dt * body.mass_scale * archetype->integrals.mass);  // then at rest
  tank.bodies.push_back(body);
  EXPECT_TRUE(tank.solve(dt).converged);
  const double weight = 1000.0 * 9.81 * archetype->volume;
  return tank.results[0].water_impulse[2] / dt / weight;
}

// Submerged share of a sphere of radius 1 whose centre is at height z over the surface.
double sphere_share(double z) {
  const double h = std::clamp(1.0 - z, 0.0, 2.0);
  return h * h * (3.0 - h) / 4.0;
}

TEST(ForceOffsets, BuoyancyIsExactAtAnySubCellPosition) {
  const auto sphere = rigid_surface_archetype(volume_true_sphere(5, kRadius), 1000.0);
  const auto cube = rigid_surface_archetype(box_surface(Vec3::Constant(2 * kHalfSide), 4), 1000.0);
  for (const double level : {0.0, 8.3})  // crossing the surface; submerged
    for (const auto& body : {sphere, cube}) {
      double sum = 0.0, worst = 0.0;
      for (int n = 0; n < 100; ++n) {
        const Vec3 x = offset(n);
        const double exact = body == sphere
                                 ? sphere_share((x[2] - level) / kRadius)
                                 : std::clamp(0.5 + (level - x[2]) / (2 * kHalfSide), 0.0, 1.0);
        const double error = buoyancy(body, x, level) / exact - 1.0;
        sum += error * error, worst = std::max(worst, std::abs(error));
      }
      std::printf("%s, %s: buoyancy error rms %.2e, worst %.2e\n",
                  body == sphere ? "sphere, 4 cells per radius" : "cube, 8.3 cells",
                  level == 0.0 ? "at the surface" : "submerged", std::sqrt(sum / 100), worst);
      EXPECT_LT(std::sqrt(sum / 100), 2e-3);
    }
}

TEST(ForceOffsets, BuoyancyDoesNotJumpWhileABodyCrossesTheSurface) {
  const auto sphere = rigid_surface_archetype(volume_true_sphere(5, kRadius), 1000.0);
  const auto cube = rigid_surface_archetype(box_surface(Vec3::Constant(2 * kHalfSide), 4), 1000.0);
  for (const auto& body : {sphere, cube}) {
    const double half = body == sphere ? kRadius : kHalfSide;
    double last = 0.0, jump = 0.0;
    for (int n = 0; n <= 100; ++n) {
      const double z = half * (1.1 - 2.2 * n / 100);  // from dry to submerged
      const double exact = body == sphere ? sphere_share(z / kRadius)
                                          : std::clamp(0.5 - z / (2 * kHalfSide), 0.0, 1.0);
      const double error = buoyancy(body, Vec3(0.21, 0.37, z), 0.0) - exact;
      if (n > 0) jump = std::max(jump, std::abs(error - last));
      last = error;
    }
    std::printf("%s: largest jump %.2e of the displaced weight\n",
                body == sphere ? "sphere" : "cube", jump);
    EXPECT_LT(jump, 0.02);
  }
}

// Worst error over sub-cell positions of the added mass of a sphere in a cube of half width 4 a,
// whose walls make a shift of half a cell matter by less than 1e-4.
double worst_added_mass_error(int cells_per_radius, int positions, double density_ratio) {
  constexpr double exact = 0.5143261253;
  const auto sphere = rigid_surface_archetype(volume_true_sphere(5, cells_per_radius), 1000.0);
  double sum = 0.0, worst = 0.0;
  for (int n = 0; n < positions; ++n) {
    CoupledTank tank(8 * cells_per_radius, 4.0 * cells_per_radius);
    ReducedBody body = make_body(sphere, 0);
    body.mass_scale = density_ratio;
    body.position = offset(n);
    body.P = Vec3(0, 0, density_ratio * sphere->integrals.mass);
    tank.bodies.push_back(body);
    EXPECT_TRUE(tank.solve(0.01).converged);
    const double added = density_ratio * (1.0 / tank.results[0].y[2] - 1.0);
    const double error = added / exact - 1.0;
    sum += error, worst = std::max(worst, std::abs(error));
  }
  std::printf(
      "added mass, %d cells per radius, density ratio %g, %d positions: mean error %+.3f %%, worst "
      "%.3f %%\n",
      cells_per_radius, density_ratio, positions, 100 * sum / positions, 100 * worst);
  return worst;
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
