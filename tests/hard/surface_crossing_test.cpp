// Hard case H33: a ball that crosses the free surface slowly, and water that runs off one. The force
// of the water on it must not jump where cells become wet or dry.
#include <algorithm>

#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

constexpr int kCells = 16;        // a metre
constexpr double kRadius = 0.25;  // of the ball, m: 4 cells
constexpr double kLevel = 0.75;   // of the water, m
constexpr double kBuoyancy = 1000.0 * 9.81 * 4.0 / 3.0 * M_PI * kRadius * kRadius * kRadius;  // N
constexpr double kAsked = 0.05;  // largest jump of the force in a step, of the buoyancy

SimulationOptions tall_tank() {
  SimulationOptions o = unit_tank(kCells);
  o.grid.nz = 3 * kCells / 2;
  o.wall_contact = false;
  return o;
}

// A heavy balance: the ball in the tank, another one outside, and a joint in the middle of the beam
// that bears the weight of both. The ball keeps the speed that it is given up or down; as the arm is
// long it moves aside by at most 1.5 cm.
constexpr double kArm = 4.0;  // m

ReducedBody balance(double height, double speed) {
  TriMesh both;
  for (const double x : {0.0, 2.0 * kArm}) {
    const TriMesh ball = volume_true_sphere(3, kRadius);
    const Vec3i first = Vec3i::Constant(static_cast<int>(both.vertices.size()));
    for (const Vec3& v : ball.vertices) both.vertices.push_back(v + Vec3(x, 0, 0));
    for (const Vec3i& t : ball.triangles) both.triangles.push_back(t + first);
  }
  ReducedBody body = make_body(rigid_surface_archetype(both, 1000.0), 0);
  body.mass_scale = 1e6;
  body.position = Vec3(0.5 + kArm, 0.5, kLevel);
  body.rotation = Quat(Eigen::AngleAxisd(std::asin((height - kLevel) / kArm), Vec3::UnitY()));
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.L = terms.inertia * Vec3(0, speed / kArm, 0);
  return body;
}
double ball_height(const ReducedBody& balance) {
  return (balance.position - balance.rotation * Vec3(kArm, 0, 0))[2];
}

// Upward force of the water on body 0, of the ball's buoyancy, at the ends of the steps.
struct Force {
  std::vector<double> time, value;

  void note(const StepReport& r, Simulation& s) {
    time.push_back(r.t), value.push_back(s.water_impulse(0)[2] / r.dt / kBuoyancy);
    s.reset_water_impulses();
  }
  // Between two steps that end after t.
  double largest_jump(double t) const {
    double jump = 0.0;
    for (std::size_t n = 1; n < time.size(); ++n)
      if (time[n - 1] > t) jump = std::max(jump, std::abs(value[n] - value[n - 1]));
    return jump;
  }
  double largest() const { return *std::max_element(value.begin() + 1, value.end()); }
  double at(double t) const {
    const std::size_t n = std::clamp<std::size_t>(
        std::lower_bound(time.begin(), time.end(), t) - time.begin(), 1, time.size() - 1);
    const double share = (t - time[n - 1]) / (time[n] - time[n - 1]);
    return (1.0 - share) * value[n - 1] + share * value[n];
  }
};

// Largest difference after t of a run's forces to those of another one.
double apart(const Force& coarse, const Force& fine, double t) {
  double most = 0.0;
  for (std::size_t n = 0; n < coarse.time.size(); ++n)
    if (coarse.time[n] > t)
      most = std::max(most, std::abs(coarse.value[n] - fine.at(coarse.time[n])));
  return most;
}

// The ball goes from one height over the surface, m, to another one. (The force of the first step is
// the impulse that sets the water in motion.)
Force cross(double from, double to, double speed, double dt) {
  const std::vector<ReducedBody> bodies = {balance(kLevel + from, speed)};
  const SimulationOptions o = tall_tank();
  Simulation s(o, water_to(o.grid, kLevel), bodies, {}, {},
               {make_joint(bodies, 0, -1, {Vec3::Zero()})});
  Force force;
  run_to(s, (to - from) / speed, dt, [&](const StepReport& r) { force.note(r, s); });
  EXPECT_NEAR(ball_height(s.bodies()[0]), kLevel + to, 0.02 * std::abs(to - from));
  return force;
}

// At steps of dt and half of it.
void expect_smooth_crossing(double from, double to, double speed, double dt, double most_jump,
                            double most_apart) {
  const Force coarse = cross(from, to, speed, dt), fine = cross(from, to, speed, 0.5 * dt);
  std::printf("%+.2f m/s, %g to %g m over the surface, %zu and %zu steps\n", speed, from, to,
              coarse.time.size(), fine.time.size());
  EXPECT_GT(coarse.largest(), 5e-3);  // wet at one end, dry at the other
  EXPECT_LT(std::min(std::abs(coarse.value[1]), std::abs(coarse.value.back())), 1e-3);
  const double settled = 1.5 * dt;
  expect_at_most("largest jump of the force, of the buoyancy",
                 std::max(coarse.largest_jump(settled), fine.largest_jump(settled)), most_jump);
  expect_at_most("forces at two step lengths apart, of the buoyancy", apart(coarse, fine, settled),
                 most_apart);
}

// Asked: jumps below 5 % of the buoyancy. Submersion alone makes 3/4 v dt / a of it in a step, and
// 1.24 times that as the water in the tank falls: 0.15 % at 1 cm/s and 0.04 s. Measured in comments:
// jump; difference of the step lengths. With the paper's voxel faces: 9 % as the pole dries, 42 % at
// 0.5 m/s.
TEST(H33Crossing, PoleOfABallLeavesTheWaterWithoutAJump) {
  expect_smooth_crossing(0.22, 0.255, 0.01, 0.04, 1e-3, 1e-3);   // 3.1e-4; 3.0e-4
  expect_smooth_crossing(0.255, 0.22, -0.01, 0.04, 2e-3, 1e-3);  // 5.6e-4; 2.1e-4
}
TEST(SlowH33Crossing, BallCrossesAtOneCentimetreASecond) {
  expect_smooth_crossing(-0.3, 0.3, 0.01, 0.04, 3e-3, 2e-3);   // 1.5e-3; 6.6e-4
  expect_smooth_crossing(0.3, -0.3, -0.01, 0.04, 3e-3, 1e-3);  // 1.5e-3; 3.8e-4
}

// The water under it and on it follows, and runs off.
TEST(H33Crossing, BallIsLiftedOutAndWaterRunsOff) {
  expect_smooth_crossing(-0.3, 0.35, 0.5, 0.01, kAsked, 0.05);  // 0.034; 0.022
}
TEST(SlowH33Crossing, BallIsLiftedOutAndWaterRunsOff) {
  expect_smooth_crossing(-0.3, 0.35, 0.1, 0.02, 0.02, 0.006);   // 0.0076; 0.0023
  expect_smooth_crossing(-0.3, 0.35, 0.2, 0.02, 0.04, 0.015);   // 0.016; 0.0062
  expect_smooth_crossing(-0.3, 0.35, 0.3, 0.02, kAsked, 0.02);  // 0.023; 0.0080
}

// The floor has a hole, 4 cells wide: the water leaves a ball that a weld holds.
Force drain(double dt) {
  SimulationOptions o = tall_tank();
  o.open_side[kZMin] = true;
  const double top = 2 * o.grid.dx, low = 0.375, high = 0.625, out = o.grid.dx;
  const std::vector<TriMesh> floor = {box_between({-out, -out, -out}, {low, 1 + out, top}),
                                      box_between({high, -out, -out}, {1 + out, 1 + out, top}),
                                      box_between({low, -out, -out}, {high, low, top}),
                                      box_between({low, high, -out}, {high, 1 + out, top})};
  const std::vector<ReducedBody> ball = {rigid_ball(kRadius, 1000.0, Vec3(0.5, 0.5, 0.65))};
  Simulation s(o, water_to(o.grid, 1.0), ball, floor, {},
               {make_joint(ball, 0, -1, {Vec3::Zero(), Vec3(kRadius, 0, 0), Vec3(0, kRadius, 0)})});
  Force force;
  run_to(s, 3.0, dt, [&](const StepReport& r) { force.note(r, s); });
  return force;
}

// After 0.4 s the flow through the hole is steady.
void expect_smooth_drain(double dt, double most_jump) {
  const Force force = drain(dt);
  EXPECT_GT(force.at(0.7), 0.95);
  EXPECT_LT(force.value.back(), 0.05);
  expect_at_most("largest jump of the force while water drains, of the buoyancy",
                 force.largest_jump(0.4), most_jump);
}
TEST(H33Crossing, WaterDrainsOffAHeldBall) { expect_smooth_drain(0.02, 0.035); }  // 0.012
TEST(SlowH33Crossing, WaterDrainsOffAHeldBall) {
  expect_smooth_drain(0.01, 0.024);   // measured 0.008
  expect_smooth_drain(0.005, 0.014);  // measured 0.0046
}

}  // namespace
}  // namespace archetide
