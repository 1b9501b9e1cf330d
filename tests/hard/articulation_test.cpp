// Jointed bodies in water.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "runtime/simulation.h"
#include "tests/hard/hard_case.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

constexpr double kLength = 0.3;

/// Three soft bars in a row, some water above and below them.
struct Train {
  std::vector<ReducedBody> bodies;
  std::vector<Joint> joints;
};
Train train(int points, double density_ratio) {
  static const SyntheticBody shape = [] {
    SyntheticOptions o;
    o.r = 6;
    o.first_omega = 60.0;
    o.alpha = 2.0;
    return deformable_archetype(box_tets(Vec3(kLength, 0.12, 0.12), Vec3i(4, 2, 2)), o);
  }();
  Train t;
  for (int k = 0; k < 3; ++k) {
    ReducedBody body = make_body(shape.archetype, 6);
    body.position = Vec3(0.2 + kLength * k, 0.5, 0.45 + 0.02 * k);
    body.mass_scale = density_ratio;
    t.bodies.push_back(body);
  }
  const double end = 0.5 * kLength, w = 0.06;
  const std::vector<Vec3> at = {Vec3(end, w, 0), Vec3(end, -w, 0), Vec3(end, 0, w)};
  for (int k = 0; k < 2 && points > 0; ++k)
    t.joints.push_back(make_joint(t.bodies, k, k + 1, {at.begin(), at.begin() + points}));
  return t;
}

SimulationOptions tank(bool water) {
  SimulationOptions o;
  o.grid = {16, 16, 12, 1.0 / 16, Vec3::Zero()};
  o.has_water = water;
  o.open_side[kZMax] = true;
  o.reference_point = Vec3(0, 0, 0.55);
  o.tolerance = 1e-6;
  return o;
}

Simulation in_water(const Train& t) {
  const SimulationOptions o = tank(true);
  return Simulation(o, water_to(o.grid, 0.55), t.bodies, {}, {}, t.joints);
}

struct Swim {
  double drift = 0.0;  // of the length
  double iterations = 0.0;
  int steps = 0, most = 0;
};
Swim swim(Simulation s, double seconds) {
  Swim out;
  while (s.time() < seconds) {
    const StepReport r = s.step(std::min(0.04, s.stable_dt()));
    out.drift = std::max(out.drift, r.joint_drift / kLength);
    out.iterations += r.position.iterations + r.velocity.iterations;
    out.most = std::max({out.most, r.position.iterations, r.velocity.iterations});
    ++out.steps;
  }
  out.iterations /= 2.0 * out.steps;
  return out;
}

void expect_few_iterations(const std::vector<double>& densities, const std::vector<int>& joints,
                           double seconds) {
  for (const double density : densities) {
    const Swim free = swim(in_water(train(0, density)), seconds);
    for (const int points : joints) {
      const Swim held = swim(in_water(train(points, density)), seconds);
      std::printf(
          "density ratio %.1f, %d points: gap %.1e, iterations %.1f (%d) against %.1f (%d)\n",
          density, points, held.drift, held.iterations, held.most, free.iterations, free.most);
      EXPECT_LE(held.drift, 1e-7);
      EXPECT_LE(held.iterations, 1.5 * free.iterations);
    }
  }
}

// Measured: jointed or not, 7.5 to 8.5 iterations; gap 6e-13.
TEST(JointsInWater, StayClosedAndCostFewIterations) { expect_few_iterations({0.3}, {3}, 0.2); }

TEST(SlowJointsInWater, StayClosedAndCostFewIterations) {
  expect_few_iterations({0.05, 0.3, 1.0}, {1, 2, 3}, 1.0);
}

/// A chain of three dropped onto the floor, and left there.
void expect_to_lie(bool water, bool between, double seconds) {
  Train t = train(1, 2.0);
  for (ReducedBody& body : t.bodies) body.position.z() -= 0.33;
  SimulationOptions o = tank(water);
  o.body_contact = between;
  o.friction = 0.3;
  o.max_dt = 0.01;
  Simulation s(o, water ? water_to(o.grid, 0.55) : FluidState(), t.bodies, {}, {}, t.joints);
  double drift = 0.0, lowest = 1.0, start = NAN, most = -INFINITY;
  StepReport r;
  while (s.time() < seconds) {
    r = s.step(std::min(0.01, s.stable_dt()));
    drift = std::max(drift, r.joint_drift / kLength);
    const double energy = r.body_kinetic + r.body_elastic + r.potential;
    if (std::isnan(start)) start = energy;
    most = std::max(most, energy - start);
    std::vector<Vec3> points;
    for (const ReducedBody& b : s.bodies()) {
      surface_points(b, points);
      for (const Vec3& x : points) lowest = std::min(lowest, x.z());
    }
  }
  double speed = 0.0;
  for (const ReducedBody& b : s.bodies()) speed = std::max(speed, b.P.norm() / body_mass(b));
  std::printf(
      "%s, %s: gap %.1e, lowest point %.1e m, speed at the end %.1e m/s, energy at most %+.1e "
      "J, %d contacts\n",
      water ? "wet" : "dry", between ? "bodies meet" : "walls only", drift, lowest, speed, most,
      r.contacts);
  EXPECT_LE(drift, 1e-7);
  // cells; where bodies meet the joints have the last word in the position update
  EXPECT_GE(lowest, -0.1 / 16);
  if (!water) {
    EXPECT_LE(most, 1e-6);
  }
  EXPECT_LE(speed, 0.5);
  EXPECT_GE(r.contacts, 1);
}

TEST(JointedChain, LiesDownOnTheFloor) {
  for (const bool between : {false, true}) {
    expect_to_lie(false, between, 1.0);
    expect_to_lie(true, between, 0.4);
  }
}

// Who has no joint pays nothing for those of others, nor for their absence: free bars spin and bend
// to the last bit as each of them alone, beside jointed ones too.
TEST(JointCost, NothingForBodiesWithoutJoints) {
  SimulationOptions vacuum;
  vacuum.gravity.setZero();
  const auto spun = [](Train t) {
    for (ReducedBody& body : t.bodies) body.L = Vec3(0.3, -0.2, 0.4);
    return t;
  };
  const auto run = [](Simulation s) {
    double drift = 0.0;
    for (int n = 0; n < 50; ++n) drift = std::max(drift, s.step(0.005).joint_drift);
    EXPECT_LE(drift, 1e-12 * kLength);
    return s.bodies();
  };
  const Train free = spun(train(0, 0.5));
  Train pair = free;
  pair.joints = {make_joint(pair.bodies, 1, 2, {Vec3(0.5 * kLength, 0, 0)})};
  const std::vector<ReducedBody> together = run(Simulation(vacuum, {}, free.bodies, {})),
                                 beside_pair =
                                     run(Simulation(vacuum, {}, pair.bodies, {}, {}, pair.joints));
  const auto expect_same_motion = [](const ReducedBody& a, const ReducedBody& b) {
    EXPECT_TRUE(a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs());
    EXPECT_TRUE(a.P == b.P && a.L == b.L && a.q == b.q && a.q_dot == b.q_dot);
  };
  for (std::size_t b = 0; b < 3; ++b)
    expect_same_motion(together[b], run(Simulation(vacuum, {}, {free.bodies[b]}, {}))[0]);
  expect_same_motion(beside_pair[0], together[0]);
  EXPECT_FALSE(beside_pair[1].L == together[1].L);
}

// A step in which the joint works is taken again, shorter [D62], from all that was there before it:
// water, the water that moves with the body, and the body are then as if it had been that short at
// once.
TEST(JointsInWater, AStepTakenAgainBeginsWhereItBegan) {
  SimulationOptions o = unit_tank(16);
  o.tolerance = 1e-10;
  std::vector<ReducedBody> ball = {rigid_ball(0.14, 500.0, Vec3(.5, .5, .5))};
  ball[0].P = body_mass(ball[0]) * Vec3(2.0, 0, 0);
  const std::vector<Joint> hinge = {make_joint(ball, 0, -1, {Vec3(0, 0, 0.14)})};
  const auto swinging = [&] { return Simulation(o, water_to(o.grid, 0.8), ball, {}, {}, hinge); };
  Simulation halved = swinging(), short_at_once = swinging();
  const StepReport again = halved.step(0.04), direct = short_at_once.step(again.dt);
  ASSERT_GT(again.halvings, 1);
  ASSERT_EQ(direct.halvings, 0);
  const Vec3 P = short_at_once.bodies()[0].P;
  const double off = (halved.bodies()[0].P - P).norm() / P.norm(),
               water = std::abs(again.water_kinetic / direct.water_kinetic - 1.0);
  // the solver's tolerance: measured 3e-11 and 6e-11 (7.6e-5 and 1.5e-4 with the carried water of the
  // attempt)
  expect_at_most("momentum against the short step", off, 9e-11);
  expect_at_most("energy of the water against it", water, 1.8e-10);
}

TEST(SlowJointsInWater, StayClosedForTenSeconds) {
  for (const int points : {1, 3}) {
    const Swim held = swim(in_water(train(points, 0.5)), 10.0);
    std::printf("%d points, %d steps: gap %.1e of the length in 10 s\n", points, held.steps,
                held.drift);
    EXPECT_LE(held.drift, 1e-6);
  }
}

}  // namespace
}  // namespace archetide
