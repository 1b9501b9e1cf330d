// Bodies that take more energy than there was to take [D63].
#include "runtime/thrown_bodies.h"

#include <gtest/gtest.h>

#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// A ball of 1 kg/m^3 in dry space falls at `speed` (m/s) for 0.01 s and then has `after`.
bool thrown(double speed, double after, int contacts, double overlap = 0.0) {
  ReducedBody ball = make_body(rigid_surface_archetype(icosphere(2, 0.1), 1.0), 0);
  const double mass = ball.archetype->integrals.mass, dt = 0.01;
  ball.P = Vec3(0, 0, -mass * speed);
  ball.last_way = VecX::Zero(6);
  ball.last_way[2] = -speed;
  SimulationState s({}, {}, {ball}, {}, {}, {}, {});
  s.bodies[0].P = Vec3(0, 0, -mass * after);
  s.bodies[0].position[2] -= 0.5 * (speed + after) * dt;
  StepReport report;
  report.contacts = contacts, report.max_penetration = overlap;
  return bodies_are_thrown(s, {ball}, report, true, dt);
}

TEST(ThrownBodies, ThoseThatFallAreNot) {
  EXPECT_FALSE(thrown(1.0, 1.0 + 0.01 * 9.81, 0));
  EXPECT_FALSE(thrown(1.0, 1.0 + 0.01 * 9.81, 1));
  EXPECT_FALSE(thrown(1.0, -0.9, 1));  // bounces
}

TEST(ThrownBodies, ThoseThatGainMoreThanThereIsAre) {
  // Twice the kinetic energy, and what weight and that of the displaced water do on twice the way.
  const double most = std::sqrt(2.0 + 4.0 * (1.0 + 1000.0) * 9.81 * (0.01 + 9.81 * 1e-4));
  EXPECT_FALSE(thrown(1.0, 0.99 * most, 0));
  EXPECT_TRUE(thrown(1.0, 1.01 * most, 0));
}

TEST(ThrownBodies, ThoseThatOnlyTouchGainNothing) {
  EXPECT_TRUE(thrown(1.0, -1.05, 1));
  EXPECT_TRUE(thrown(1.0, -1.05, 1, 1e-4));
  EXPECT_FALSE(thrown(1.0, -1.05, 1, 0.2));  // pushed out of a deep overlap
}

}  // namespace
}  // namespace archetide
