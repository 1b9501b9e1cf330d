// What a step that breaks says: body, mode, cell, time.
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/failure.h"
#include "runtime/scene/limits.h"
#include "tests/hard/hard_case.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// Two soft boxes over water, four cells wide; the second one bent by q.
Simulation two_boxes(int max_iterations, double q) {
  SimulationOptions o;
  o.grid.nx = o.grid.ny = o.grid.nz = 12;
  o.grid.dx = 1.0 / 12;
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.max_iterations = max_iterations;
  if (max_iterations == 1) o.tolerance = 1e-14;
  FluidState fluid;
  fluid.phi.resize(12, 12, 12);
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i) fluid.phi(i, j, k) = o.grid.cell_centre(i, j, k)[2] - 0.5;
  SyntheticOptions soft;
  soft.r = 3, soft.density = 600.0, soft.first_omega = 30.0;
  const auto box = deformable_archetype(box_tets(Vec3(0.2, 0.2, 0.15), Vec3i(2, 2, 2)), soft);
  std::vector<ReducedBody> bodies(2, make_body(box.archetype, 3));
  bodies[0].position = Vec3(0.3, 0.5, 0.5);
  bodies[1].position = Vec3(0.7, 0.5, 0.5);
  bodies[1].q[2] = q;
  return Simulation(o, std::move(fluid), bodies, {});
}

template <class Action>
SimulationFailure failure_of(const Action& action) {
  try {
    action();
  } catch (const SimulationFailure& failure) {
    return failure;
  }
  return {"none", "no failure", -1.0, {}};
}

TEST(Failure, ABodyThatIsNotFiniteIsNamedWithItsMode) {
  Simulation simulation = two_boxes(200, 0.0);
  simulation.step(0.002);
  simulation.bodies()[1].q[2] = std::nan("");
  const SimulationFailure failure = failure_of([&] { simulation.step(0.002); });
  EXPECT_EQ(failure.quantity, "finite") << failure.what();
  EXPECT_EQ(failure.culprit.body, 1);
  EXPECT_EQ(failure.culprit.mode, 2);
  EXPECT_NE(std::string(failure.what()).find("(body 1, mode 3)"), std::string::npos);
}

// H40: never goes on with a pressure that has not converged.
TEST(Failure, AStepThatCannotConvergeNamesACellAndTheBodyAtIt) {
  Simulation simulation = two_boxes(1, 0.5);
  const SimulationFailure failure = failure_of([&] { simulation.step(0.002); });
  EXPECT_EQ(failure.quantity, "convergence") << failure.what();
  EXPECT_EQ(failure.time, 0.0);
  EXPECT_GE(failure.culprit.body, 0);
  ASSERT_TRUE(failure.culprit.cell);
  EXPECT_LE((*failure.culprit.cell)[2], 6);  // in the water
  EXPECT_EQ(simulation.time(), 0.0);
}

// A chain of three balls whose second joint has been torn: its two points are 0.1 m apart on one
// ball and 0.15 m on the other.
TEST(Failure, AJointThatCannotCloseIsNamedWithItsBodies) {
  const auto shape = rigid_surface_archetype(icosphere(2, 0.1), 500.0);
  std::vector<ReducedBody> balls(3, make_body(shape, 0));
  for (int b = 0; b < 3; ++b) balls[b].position = Vec3(0.2 * b, 0, 0);
  const std::vector<Vec3> hinge = {Vec3(0.1, 0, 0.05), Vec3(0.1, 0, -0.05)};
  std::vector<Joint> joints = {make_joint(balls, 0, 1, hinge), make_joint(balls, 1, 2, hinge)};
  const auto failing = [&] {
    Simulation chain(SimulationOptions(), {}, balls, {}, {}, joints);
    return failure_of([&] { chain.step(0.01); });
  };
  EXPECT_EQ(failing().quantity, "none");
  joints[1].at_b[1].rest[2] -= 0.05;
  const SimulationFailure between = failing();
  EXPECT_EQ(between.quantity, "joint") << between.what();
  EXPECT_EQ(between.culprit.joint, 1);
  EXPECT_EQ(between.culprit.body, 1);
  EXPECT_EQ(between.culprit.other_body, 2);
  EXPECT_NE(std::string(between.what()).find("(joint 1, body 1, body 2)"), std::string::npos);

  joints = {joints[0], make_joint(balls, 2, -1, hinge)};
  joints[1].at_world[0][2] += 0.05;
  const SimulationFailure to_world = failing();
  EXPECT_EQ(to_world.quantity, "joint") << to_world.what();
  EXPECT_EQ(to_world.culprit.body, 2);
  EXPECT_NE(std::string(to_world.what()).find("(joint 1, body 2, the world)"), std::string::npos);
}

TEST(Limits, NameBodyModeAndCell) {
  Simulation simulation = two_boxes(200, 0.5);
  const StepReport report = simulation.step(0.002);
  const auto crossed = [&](const LimitSpec& spec) {
    LimitWatch watch(spec);
    return failure_of([&] { watch.observe(report, simulation); });
  };
  EXPECT_EQ(crossed({}).quantity, "none");
  const SimulationFailure bent = crossed({.deformation = 0.01});
  EXPECT_EQ(bent.quantity, "limits.deformation");
  EXPECT_EQ(bent.culprit.body, 1);
  EXPECT_EQ(bent.culprit.mode, 2);
  EXPECT_NEAR(bent.time, 0.002, 1e-15);
  const SimulationFailure fast = crossed({.speed = 1e-6});
  EXPECT_EQ(fast.quantity, "limits.speed");
  EXPECT_TRUE(fast.culprit.cell || fast.culprit.body == 1);
  EXPECT_EQ(crossed({.iterations = 1}).quantity, "limits.iterations");
  EXPECT_EQ(crossed({.speed = 1e3, .deformation = 10.0, .energy = 0.1, .iterations = 200}).quantity,
            "none");
}

TEST(Limits, EnergyCountsWhatComesFromNothing) {
  Simulation simulation = two_boxes(200, 0.5);
  LimitWatch watch({.energy = 0.2});
  StepReport report = simulation.step(0.002);
  watch.observe(report, simulation);
  const double moving = report.water_kinetic + report.body_kinetic + report.body_elastic;
  report.body_kinetic += 0.1 * moving;
  watch.observe(report, simulation);  // less than the limit
  report.body_kinetic += moving;
  report.actuation_work += moving;
  watch.observe(report, simulation);  // somebody has worked for it
  report.body_kinetic += moving;
  EXPECT_EQ(failure_of([&] { watch.observe(report, simulation); }).quantity, "limits.energy");
}

// The origin lies above the water, where its potential energy is below zero: what flows out through
// an open side raises the sum of what is left, and is no gain.
TEST(Limits, WaterThatLeavesBelowTheOriginIsNoGain) {
  SimulationOptions o = unit_tank(12);
  o.grid.origin = Vec3(0, 0, -2.0);
  Simulation simulation(o, water_to(o.grid, -1.5), {}, {});
  StepReport report = simulation.step(0.01);
  LimitWatch watch({.energy = 0.01});
  watch.observe(report, simulation);
  ASSERT_LT(report.potential, 0.0);
  const double part = 0.2;
  report.outflow_volume += part * report.water_volume;
  report.water_volume *= 1.0 - part, report.potential *= 1.0 - part;
  watch.observe(report, simulation);
}

}  // namespace
}  // namespace archetide
