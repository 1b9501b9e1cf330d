// Velocities that the scene gives and that do not fit each other: water towards a wall or a body.
// They meet in an instant: pressure impulses, no time, nothing from nothing.
#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

SimulationOptions weightless_tank(int cells) {
  SimulationOptions o = unit_tank(cells);
  o.open_side[kZMax] = false;
  o.gravity.setZero();
  o.tolerance = 1e-10;
  return o;
}

// In a closed tank full of water a uniform stream is the gradient of a potential: nothing is left.
TEST(GivenVelocity, StreamInAFullTankStopsAtItsWalls) {
  const SimulationOptions o = weightless_tank(12);
  FluidState water = water_to(o.grid, INFINITY);
  set_velocity(
      o.grid, [](const Vec3&) { return Vec3(1.0, 0.5, -0.3); }, water);
  Simulation s(o, water, {}, {});
  EXPECT_LT(s.step(0.05).max_speed, 1e-9);  // measured 2e-11 m/s, tolerance 1e-10
}

// A cube of water that flies at U, and in it a light ball at rest. Seen from the water the ball
// strikes it at -U and takes its added mass k along: it goes on at k / (s + k) U, with k = 1/2 in
// much water and less in little. Momentum is what it was; and nothing depends on the step.
TEST(GivenVelocity, BallAtRestInAStreamIsStruckOnce) {
  constexpr double kSpeed = 0.2, kRatio = 0.1;
  const SimulationOptions o = weightless_tank(32);
  const auto struck = [&](double dt) {
    FluidState water = water_where(o.grid, [](const Vec3& x) {
      return box_distance(x, Vec3::Constant(.2), Vec3::Constant(.8));
    });
    set_velocity(
        o.grid, [&](const Vec3&) { return Vec3(0, 0, kSpeed); }, water);
    Simulation s(o, water, {rigid_ball(0.12, 1000.0 * kRatio, Vec3(.5, .5, .5))}, {});
    const StepReport r = s.step(dt);
    const double given = 1000.0 * r.accounted_volume() * kSpeed,
                 now = r.water_momentum[2] + r.body_momentum[2],
                 ball = r.body_momentum[2] / body_mass(s.bodies()[0]) / kSpeed;
    std::printf("measured: step %g s: momentum %.1e off, ball at %.4f U\n", dt, now / given - 1.0,
                ball);
    EXPECT_NEAR(now, given, 6e-4 * given);
    return ball;
  };
  const double at_once = struck(1e-6), later = struck(1e-2);
  EXPECT_NEAR(at_once, 0.5 / (kRatio + 0.5), 0.03);  // measured 0.814 of 0.833
  EXPECT_NEAR(later, at_once, 3e-4);                 // measured 1e-4
}

}  // namespace
}  // namespace archetide
