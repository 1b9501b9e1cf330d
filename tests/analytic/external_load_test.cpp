// Bodies that forces and torques from outside push, in vacuum and under water.
#include <gtest/gtest.h>

#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

Simulation in_vacuum(const ReducedBody& body, const ExternalLoad& load, Scheme scheme) {
  SimulationOptions options;
  options.gravity = Vec3::Zero();
  options.wall_contact = false;
  options.scheme = scheme;
  Simulation simulation(options, {}, {body}, {});
  simulation.set_external_loads({load});
  return simulation;
}

// A soft body is pushed off and turned: its particles share the force, so that it does not bend but by
// what the turning does.
TEST(ExternalLoad, GivesItsImpulseAndItsWork) {
  const SyntheticBody synthetic = random_archetype(11, 5);
  const Vec3 F(3, -2, 5);
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle}) {
    const ReducedBody start = make_body(synthetic.archetype, 5);
    Simulation s = in_vacuum(start, {0, {{0.0, F, Vec3::Zero()}}}, scheme);
    StepReport r;
    for (int n = 0; n < 100; ++n) r = s.step(0.01);
    const ReducedBody& body = s.bodies()[0];
    EXPECT_LT((body.P - F).norm(), 1e-13 * F.norm());
    EXPECT_LT((r.budget.external.P - 0.99 * F).norm(), 1e-13 * F.norm());  // without the first step
    const Vec3 way = F / (2.0 * body_mass(body));
    EXPECT_LT((body.position - start.position - way).norm(), 1e-12 * way.norm());
    EXPECT_EQ(body.L, Vec3::Zero());
    EXPECT_LT(body.q.norm(), 1e-14);
    EXPECT_NEAR(r.actuation_work, kinetic_energy(body), 1e-12 * kinetic_energy(body));
  }
}

TEST(ExternalLoad, TurnsABody) {
  const ReducedBody start = rigid_ball(0.2, 500.0, Vec3::Zero());
  const Vec3 T(0.1, 0.2, -0.3);
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle}) {
    Simulation s = in_vacuum(start, {0, {{0.0, Vec3::Zero(), T}}}, scheme);
    StepReport r;
    for (int n = 0; n < 50; ++n) r = s.step(0.02);
    const ReducedBody& ball = s.bodies()[0];
    EXPECT_LT((ball.L - T).norm(), 1e-13 * T.norm());
    EXPECT_NEAR(r.actuation_work, kinetic_energy(ball),
                1e-6 * kinetic_energy(ball));  // a polyhedron
  }
}

// Steps that end where the table bends give its integral; nothing acts before and after.
TEST(ExternalLoad, FollowsItsTable) {
  const Vec3 none = Vec3::Zero();
  ExternalLoad load{0, {{0.1, none, none}, {0.3, {2, 0, 0}, none}, {0.5, {2, 4, 0}, none}}};
  load.end = 0.7;
  Simulation s = in_vacuum(rigid_ball(0.2, 500.0, Vec3::Zero()), load, Scheme::kNewmark);
  for (int n = 0; n < 10; ++n) s.step(0.1);
  EXPECT_LT((s.bodies()[0].P - Vec3(0.2 + 0.8, 0.4 + 0.8, 0)).norm(), 1e-13);
}

// In a closed cube of twice its size a ball has the added mass 0.622827 of what it displaces.
// Measured: 3e-4.
TEST(ExternalLoad, MeetsTheAddedMass) {
  SimulationOptions o = unit_tank(16);
  o.open_side[kZMax] = false;
  o.gravity = Vec3::Zero();
  o.tolerance = 1e-10;
  const double F = 1.0, dt = 1e-3;
  const ReducedBody ball = rigid_ball(0.25, 500.0, Vec3(0.5, 0.5, 0.5));
  Simulation s(o, water_where(o.grid, [](const Vec3&) { return -1.0; }), {ball}, {});
  s.set_external_loads({{0, {{0.0, Vec3(F, 0, 0), Vec3::Zero()}}}});
  s.step(dt);
  s.step(dt);
  const double displaced = o.water_density * ball.archetype->volume;
  EXPECT_NEAR(
      velocity_of(s.bodies()[0])[0] * (body_mass(ball) + 0.622827 * displaced) / (2 * F * dt), 1.0,
      2e-3);
}

}  // namespace
}  // namespace archetide
