#include <cstdio>

#include "common/base/input_error.h"
#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

constexpr int kCells = 16;

SimulationOptions closed_tank(bool water) {
  SimulationOptions o;
  o.grid = {kCells, kCells, kCells, 1.0 / kCells, Vec3::Zero()};
  o.has_water = water;
  return o;
}

ReducedBody soft_body(const Vec3& position) {
  static const SyntheticBody shape = random_archetype(3, 4);
  ReducedBody body = make_body(shape.archetype, 4);
  body.position = position;
  body.mass_scale = 0.5;
  return body;
}

void run(Simulation& simulation, int steps = 20) {
  for (int n = 0; n < steps; ++n) {
    const StepReport r = simulation.step(std::min(0.01, simulation.stable_dt()));
    ASSERT_NO_FATAL_FAILURE(expect_finite(r));
  }
  expect_sound(simulation.bodies());
}

TEST(DegenerateScenes, NothingAtAllSteps) {
  Simulation simulation(SimulationOptions(), FluidState(), {}, {});
  run(simulation);
}

TEST(DegenerateScenes, ObstacleWithoutATankIsAnEmptySet) {
  Simulation simulation(SimulationOptions(), FluidState(), {}, {icosphere(1, 0.1)});
  run(simulation, 2);
}

TEST(DegenerateScenes, BodyWithoutWaterFallsFreely) {
  SimulationOptions o;  // no tank
  Simulation simulation(o, FluidState(), {soft_body(Vec3::Zero())}, {});
  for (int n = 0; n < 100; ++n) simulation.step(0.01);
  // velocity Verlet is exact for a constant force
  EXPECT_NEAR(simulation.bodies()[0].position[2], -0.5 * 9.81, 1e-12);
}

// Refinement by the residual in double precision: no step is halved for a tolerance at the limit.
TEST(DegenerateScenes, TightestTolerancesAreMetInASplash) {
  SimulationOptions o = closed_tank(true);
  o.tolerance = 1e-13;
  o.body_contact = true;
  const FluidState water = water_where(o.grid, [](const Vec3& x) {
    return std::min(x[2] - 0.3, box_distance(x, Vec3(0.0, 0.0, 0.45), Vec3(0.4, 0.6, 0.8)));
  });
  Simulation s(o, water, {soft_body(Vec3(0.68, 0.52, 0.45))}, {});
  double worst = 0.0;
  for (int n = 0; n < 40; ++n) {
    const StepReport r = s.step(std::min(0.01, s.stable_dt()));
    EXPECT_EQ(r.halvings, 0) << n;
    for (const SolveReport* solve : {&r.position, &r.velocity}) {
      EXPECT_TRUE(solve->converged) << n;
      worst = std::max(worst, solve->residual);
    }
  }
  std::printf("measured: largest residual %.1e at t = %.2f s\n", worst, s.time());
}

TEST(DegenerateScenes, WaterWithoutBodyStaysStill) {
  SimulationOptions o = closed_tank(true);
  Simulation simulation(o, water_to(o.grid, 0.4), {}, {});
  run(simulation);
}

TEST(DegenerateScenes, BodyInADryTankLandsOnTheFloor) {
  SimulationOptions o = closed_tank(false);
  Simulation simulation(o, FluidState(), {soft_body(Vec3(0.5, 0.5, 0.5))}, {});
  run(simulation, 200);
  double lowest = INFINITY;
  std::vector<Vec3> points;
  surface_points(simulation.bodies()[0], points);
  for (const Vec3& p : points) lowest = std::min(lowest, p[2]);
  EXPECT_GT(lowest, -0.01 * o.grid.dx);
  EXPECT_LT(lowest, 0.1);
}

TEST(DegenerateScenes, TankFullToTheLidSteps) {
  SimulationOptions o = closed_tank(true);
  Simulation simulation(o, water_to(o.grid, INFINITY), {soft_body(Vec3(0.5, 0.5, 0.5))}, {});
  run(simulation);
}

TEST(DegenerateScenes, RigidBodyInFullTankRisesWithoutPressureLevel) {
  SimulationOptions o = closed_tank(true);
  ReducedBody sphere = make_body(rigid_surface_archetype(volume_true_sphere(3, 0.2), 500.0), 0);
  sphere.position = Vec3(0.5, 0.5, 0.4);
  Simulation simulation(o, water_to(o.grid, INFINITY), {sphere}, {});
  run(simulation, 10);
  EXPECT_GT(simulation.bodies()[0].position[2], 0.401);
}

TEST(DegenerateScenes, BodyHalfOutsideTheGridSteps) {
  SimulationOptions o = closed_tank(true);
  o.open_side = {true, true, true, true, true, true};
  o.open_side[kZMin] = false;
  for (const Vec3& position :
       {Vec3(0.0, 0.5, 0.3), Vec3(1.0, 1.0, 0.4), Vec3(0.5, 0.5, 1.0), Vec3(5.0, 5.0, 5.0)}) {
    Simulation simulation(o, water_to(o.grid, 0.4), {soft_body(position)}, {});
    run(simulation, 5);
  }
}

TEST(DegenerateScenes, BodyInAWallIsPushedBack) {
  SimulationOptions o = closed_tank(true);
  Simulation simulation(o, water_to(o.grid, 0.4), {soft_body(Vec3(0.05, 0.5, 0.4))}, {});
  run(simulation, 5);
  std::vector<Vec3> points;
  surface_points(simulation.bodies()[0], points);
  for (const Vec3& p : points) EXPECT_GT(p[0], -0.01 * o.grid.dx);
}

TEST(DegenerateScenes, TwoBodiesInOneAnotherStep) {
  SimulationOptions o = closed_tank(true);
  Simulation simulation(o, water_to(o.grid, 0.5),
                        {soft_body(Vec3(0.5, 0.5, 0.4)), soft_body(Vec3(0.6, 0.5, 0.45))}, {});
  run(simulation, 5);
}

TEST(DegenerateScenes, BodySmallerThanACellSinksOrRises) {
  for (const double density : {300.0, 3000.0}) {
    SimulationOptions o = closed_tank(true);
    ReducedBody bead =
        make_body(rigid_surface_archetype(volume_true_sphere(1, 0.1 * o.grid.dx), density), 0);
    bead.position = Vec3(0.53, 0.47, 0.3);
    Simulation simulation(o, water_to(o.grid, 0.6), {bead}, {});
    run(simulation, 5);
    EXPECT_EQ(simulation.bodies()[0].position[2] > 0.3, density < 1000.0);
  }
}

TEST(DegenerateScenes, SolverThatCannotConvergeIsAnErrorNotGarbage) {
  SimulationOptions o = closed_tank(true);
  o.max_iterations = 1;
  o.tolerance = 1e-14;
  ReducedBody sphere = make_body(rigid_surface_archetype(volume_true_sphere(2, 0.2), 100.0), 0);
  sphere.position = Vec3(0.5, 0.5, 0.3);
  Simulation simulation(o, water_to(o.grid, 0.6), {sphere}, {});
  EXPECT_THROW(simulation.step(0.01), NumericsError);
}

}  // namespace
}  // namespace archetide
