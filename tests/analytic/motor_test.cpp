// Motors: torques between two bodies, or of a body and the world.
#include <gtest/gtest.h>

#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

Simulation in_vacuum(std::vector<ReducedBody> bodies, std::vector<Motor> motors,
                     std::vector<Joint> joints = {}) {
  SimulationOptions options;
  options.gravity = Vec3::Zero();
  options.wall_contact = false;
  Simulation simulation(options, {}, std::move(bodies), {}, {}, std::move(joints));
  simulation.set_motors(std::move(motors));
  return simulation;
}

Motor along_z(double torque) {
  Motor motor;
  motor.a = 0, motor.torque = torque;
  return motor;
}

Mat3 inertia_of(const ReducedBody& body) {
  return configuration_terms(body, current_configuration(body), ModalMass::kExact).inertia;
}

double spin_of(const ReducedBody& body) { return inertia_of(body).inverse().row(2).dot(body.L); }

// Two balls, each with the other's torque: w = T / I (1 / I_a + 1 / I_b) t without load, and
// w = w0 (1 - exp(-t / tau)), tau = w0 / (T (1 / I_a + 1 / I_b)), with a no-load speed. Measured after
// 1.5 tau in 30 and 60 steps: 9.0e-5, 2.2e-5.
TEST(Motor, SpeedsUpAsADirectCurrentMotor) {
  const std::vector<ReducedBody> balls = {rigid_ball(0.2, 500.0, Vec3::Zero()),
                                          rigid_ball(0.3, 300.0, Vec3(1, 0, 0))};
  const double a = inertia_of(balls[0])(2, 2), b = inertia_of(balls[1])(2, 2), T = 2.0, w0 = 5.0,
               tau = w0 / (T * (1.0 / a + 1.0 / b));
  Motor motor = along_z(T);
  motor.b = 1;
  Simulation steady = in_vacuum(balls, {motor});
  for (int n = 0; n < 10; ++n) steady.step(0.05);
  EXPECT_NEAR(spin_of(steady.bodies()[0]), 0.5 * T / a, 1e-10);
  EXPECT_NEAR(spin_of(steady.bodies()[1]), -0.5 * T / b, 1e-10);
  motor.speed = w0;
  double before = 0.0;
  for (const int steps : {30, 60}) {
    Simulation s = in_vacuum(balls, {motor});
    for (int n = 0; n < steps; ++n) s.step(1.5 * tau / steps);
    const double w = spin_of(s.bodies()[0]) - spin_of(s.bodies()[1]);
    const double off = std::abs(w / (w0 * (1.0 - std::exp(-1.5))) - 1.0);
    std::printf("measured: %.2e off after %d steps\n", off, steps);
    EXPECT_LT((s.bodies()[0].L + s.bodies()[1].L).norm(), 1e-14 * T * 1.5 * tau);
    if (before > 0.0) {
      EXPECT_LT(off, 0.3 * before);  // second order
    }
    before = off;
  }
  EXPECT_LT(before, 7e-5);
}

// However strong it is: a step of a hundred of its own times goes to the speed without load.
TEST(Motor, IsStableAtAnyStep) {
  const std::vector<ReducedBody> ball = {rigid_ball(0.2, 500.0, Vec3::Zero())};
  const double inertia = inertia_of(ball[0])(2, 2);
  Motor motor = along_z(1000.0 * inertia);
  motor.speed = 0.5;
  Simulation s = in_vacuum(ball, {motor});
  double largest = 0.0;
  for (int n = 0; n < 200; ++n) {
    s.step(0.05);
    largest = std::max(largest, spin_of(s.bodies()[0]));
  }
  EXPECT_LT(largest, 1.0);
  EXPECT_NEAR(spin_of(s.bodies()[0]), 0.5, 1e-3);
}

// To and fro: the speed is the integral of the sine, between start and end only.
TEST(Motor, FollowsItsSupply) {
  const std::vector<ReducedBody> ball = {rigid_ball(0.2, 500.0, Vec3::Zero())};
  const double inertia = inertia_of(ball[0])(2, 2), T = 0.3, period = 0.8;
  Motor motor = along_z(T);
  motor.period = period, motor.phase = 0.5 * M_PI, motor.start = 0.2, motor.end = 0.4;
  Simulation s = in_vacuum(ball, {motor});
  while (s.time() < 0.2 - 1e-9) s.step(0.01);
  EXPECT_EQ(s.bodies()[0].L, Vec3::Zero());
  while (s.time() < 0.6 - 1e-9) s.step(0.01);
  const double full = T / inertia * period / (2.0 * M_PI);  // a quarter of a period
  EXPECT_NEAR(spin_of(s.bodies()[0]), full, 1e-3 * full);
}

// Soft bodies on a hinge along the axis, oblique and turned: P and L stay what they were, and the motor's
// work is the energy that the bodies have. Measured: 1.5e-6 of 0.47 J; P exactly, L 2e-14.
TEST(Motor, DoesTheWorkThatJointedBodiesGet) {
  std::vector<ReducedBody> bodies = {make_body(random_archetype(11, 5).archetype, 5),
                                     make_body(random_archetype(3, 4).archetype, 4)};
  bodies[0].rotation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 0).normalized()));
  bodies[1].position = Vec3(0.6, 0.1, -0.1);
  const Vec3 axis = Vec3(0.3, 0.1, 1).normalized();
  const Joint hinge = make_joint(bodies, 0, 1, {Vec3(0.2, 0, 0), Vec3(0.2, 0, 0) + 0.2 * axis});
  Motor motor;
  motor.a = 0, motor.b = 1, motor.axis = axis, motor.torque = 0.5, motor.speed = 8.0;
  Simulation s = in_vacuum(bodies, {motor}, {hinge});
  StepReport r;
  double off = 0.0, most = 0.0, L = 0.0, P = 0.0;
  while (s.time() < 2.0) {
    r = s.step(std::min(s.stable_dt(), 0.01));
    double energy = 0.0;
    Vec3 moment = Vec3::Zero(), momentum = Vec3::Zero();
    for (const ReducedBody& b : s.bodies()) {
      energy += kinetic_energy(b) + elastic_energy(b);
      moment += b.L + b.position.cross(b.P), momentum += b.P;
    }
    most = std::max(most, energy);
    off = std::max(off, std::abs(energy - r.actuation_work));
    L = std::max(L, moment.norm()), P = std::max(P, momentum.norm());
  }
  std::printf("measured: energy off by %.1e of %.2e J, P %.1e, L %.1e, joint %.1e m\n", off, most,
              P, L, r.joint_drift);
  EXPECT_GT(most, 0.1);
  EXPECT_LT(off, 1e-5 * most);
  EXPECT_EQ(P, 0.0);
  EXPECT_LT(L, 7e-14);
}

// A block that turns under water on a hinge: what the motor does is what water and block have, less what
// is lost by moving the water through the grid. Measured: 1.74 J of 2.29 J of work, 0.92 J of it in the water.
TEST(Motor, StirsTheWater) {
  SimulationOptions o = unit_tank(20);
  o.open_side[kZMax] = false;
  o.gravity = Vec3::Zero();
  ReducedBody block = make_body(
      rigid_surface_archetype(box_between(Vec3(-0.3, -0.1, -0.15), Vec3(0.3, 0.1, 0.15)), 1000.0),
      0);
  block.position = Vec3(0.5, 0.5, 0.5);
  const Joint hinge = make_joint({block}, 0, -1, {Vec3::Zero(), Vec3(0, 0, 0.2)});
  Motor motor = along_z(2.0);
  motor.speed = 4.0;
  Simulation s(o, water_where(o.grid, [](const Vec3&) { return -1.0; }), {block}, {}, {}, {hinge});
  s.set_motors({motor});
  StepReport r;
  while (s.time() < 2.0) r = s.step(std::min(s.stable_dt(), 0.02));
  const double stored = r.water_kinetic + r.body_kinetic, spin = spin_of(s.bodies()[0]);
  std::printf("measured: %.3f rad/s, %.3f J of %.3f J of work, water %.3f J\n", spin, stored,
              r.actuation_work, r.water_kinetic);
  EXPECT_GT(spin, 1.0);
  EXPECT_LT(spin, 4.0);
  EXPECT_GT(r.water_kinetic, 0.05 * stored);
  EXPECT_LT(stored, 1.001 * r.actuation_work);
  EXPECT_GT(stored, 0.5 * r.actuation_work);
}

}  // namespace
}  // namespace archetide
