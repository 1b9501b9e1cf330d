// Passive markers beside a body that ploughs through them.
#include <gtest/gtest.h>

#include <cstdio>

#include "runtime/simulation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// A ball of 2.4 cells radius through a cloud of markers in a full tank.
Simulation ball_in_cloud(int markers) {
  SimulationOptions options;
  options.grid.nx = options.grid.ny = options.grid.nz = 16;
  options.grid.dx = 1.0 / 16;
  options.has_water = true;
  options.gravity = Vec3::Zero();
  FluidState fluid;
  fluid.phi.resize(16, 16, 16, -2.0);
  for (int n = 0; n < markers; ++n)  // a lattice about the path
    fluid.markers.emplace_back(0.3 + 0.4 * (n % 8) / 7.0, 0.3 + 0.4 * (n / 8 % 8) / 7.0,
                               0.1 + 0.8 * (n / 64) / 7.0);
  ReducedBody ball = make_body(rigid_surface_archetype(icosphere(3, 0.15), 2000.0), 0);
  ball.position = Vec3(0.5, 0.5, 0.25);
  ball.P = Vec3(0, 0, ball.archetype->integrals.mass);  // 1 m/s
  return Simulation(options, std::move(fluid), {ball}, {});
}

TEST(Markers, NoneEntersAMovingBall) {
  Simulation simulation = ball_in_cloud(512);
  const auto least_distance = [&] {
    double least = INFINITY;
    for (const Vec3& x : simulation.fluid().markers)
      least = std::min(least, (x - simulation.bodies()[0].position).norm());
    return least;
  };
  // flat triangles lie up to 0.15 (1 - cos(half an edge's angle)) = 6e-4 m inside the sphere, and
  // the sampled distance is good to a tenth of its cells of 0.3 m / 32
  const double allowed = 0.15 - 6e-4 - 1e-3;
  double worst = least_distance();  // those that began inside have been put outside
  EXPECT_GE(worst, allowed);
  double moved = 0.0;
  const std::vector<Vec3> start = simulation.fluid().markers;
  while (simulation.time() < 0.3) {
    simulation.step(simulation.stable_dt());
    worst = std::min(worst, least_distance());
  }
  for (std::size_t n = 0; n < start.size(); ++n)
    moved = std::max(moved, (simulation.fluid().markers[n] - start[n]).norm());
  std::printf("least distance %.5f m of 0.15 m, farthest path %.3f m, ball at %.3f m\n", worst,
              moved, simulation.bodies()[0].position[2]);
  EXPECT_GE(worst, allowed);
  EXPECT_GT(moved, 0.05);
}

TEST(Markers, ChangeNothingElse) {
  Simulation with = ball_in_cloud(64), without = ball_in_cloud(0);
  for (int i = 0; i < 10; ++i) {
    with.step(0.01);
    without.step(0.01);
  }
  EXPECT_EQ(with.bodies()[0].P, without.bodies()[0].P);
  EXPECT_EQ(with.bodies()[0].position, without.bodies()[0].position);
}

}  // namespace
}  // namespace archetide
