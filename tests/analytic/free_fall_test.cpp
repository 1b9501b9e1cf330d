// A body in the air above still water does not set the step; near the water it does.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "runtime/simulation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kG = 9.81, kRadius = 0.1, kLevel = 0.25;
constexpr int kCells = 32;

// A ball, `height` above 0.25 m of still water in a tank of 1 m; `beside`: a second one next to it.
Simulation ball_above_water(double height, bool beside) {
  SimulationOptions options;
  options.grid.nx = options.grid.ny = options.grid.nz = kCells;
  options.grid.dx = 1.0 / kCells;
  options.has_water = true;
  options.body_contact = true;
  options.open_side[kZMax] = true;
  FluidState fluid;
  fluid.phi.resize(kCells, kCells, kCells);
  for (int k = 0; k < kCells; ++k)
    for (int j = 0; j < kCells; ++j)
      for (int i = 0; i < kCells; ++i)
        fluid.phi(i, j, k) = options.grid.cell_centre(i, j, k)[2] - kLevel;
  ReducedBody ball = make_body(rigid_surface_archetype(icosphere(3, kRadius), 500.0), 0);
  ball.position = Vec3(0.5, 0.5, kLevel + kRadius + height);
  std::vector<ReducedBody> bodies{ball};
  if (beside) bodies.push_back(ball), bodies.back().position[0] += 2.0 * kRadius + 0.01;
  return Simulation(options, std::move(fluid), bodies, {});
}

TEST(FreeFall, StepsAreLongUntilTheWaterIsNear) {
  Simulation simulation = ball_above_water(0.4, false);
  const double start = simulation.bodies()[0].position[2];
  const double dx = simulation.grid().dx;
  double free_way = 0.0;
  while (simulation.time() < 0.3) {
    const double before = simulation.bodies()[0].position[2];
    const double gap = before - kRadius - kLevel;
    const double dt = simulation.stable_dt();
    simulation.step(dt);
    const double now = simulation.bodies()[0].position[2], t = simulation.time();
    // speed dt + g dt^2 <= way, of which the body moves all but g dt^2 / 2: never more than the
    // cells of the CFL number, or what was left but for two cells (and one of the water's layers).
    EXPECT_LE(before - now, std::max(dx, gap - 2.0 * dx));
    if (now - kRadius > kLevel + 4.0 * dx) {
      // constant acceleration, which the scheme follows exactly
      EXPECT_NEAR(now, start - 0.5 * kG * t * t, 1e-12);
      free_way = std::max(free_way, before - now);
    }
  }
  std::printf("longest way of a step in the air %.1f cells\n", free_way / dx);
  EXPECT_GT(free_way, 1.5 * dx);
}

TEST(FreeFall, BodiesNextToEachOtherKeepToTheCflNumber) {
  Simulation simulation = ball_above_water(0.4, true);
  const double dx = simulation.grid().dx;
  for (int n = 0; n < 20; ++n) {
    const double before = simulation.bodies()[0].position[2];
    simulation.step(simulation.stable_dt());
    EXPECT_LE(before - simulation.bodies()[0].position[2], dx);
  }
}

}  // namespace
}  // namespace archetide
