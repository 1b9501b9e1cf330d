// Bodies against each other and against obstacles, without water.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "common/mesh/mesh_sdf.h"
#include "tests/hard/hard_case.h"
#include "tests/support/momenta.h"

namespace archetide {
namespace {

constexpr double kGravity = 9.81;

/// No tank, no water: bodies in vacuum that may touch.
SimulationOptions vacuum(double gravity) {
  SimulationOptions o;
  o.gravity = Vec3(0, 0, -gravity);
  o.body_contact = true;
  o.max_dt = 0.01;
  return o;
}

/// A dry tank of 1 m^3.
SimulationOptions dry_tank() {
  SimulationOptions o = vacuum(kGravity);
  o.grid = {32, 32, 32, 1.0 / 32, Vec3::Zero()};
  return o;
}

ReducedBody ball(double radius, const Vec3& position, const Vec3& velocity = Vec3::Zero()) {
  static std::map<double, std::shared_ptr<const Archetype>> shapes;
  auto& shape = shapes[radius];
  if (!shape) shape = rigid_surface_archetype(volume_true_sphere(3, radius), 1000.0);
  ReducedBody body = make_body(shape, 0);
  body.position = position;
  body.P = shape->integrals.mass * velocity;
  return body;
}

ReducedBody box(const Vec3& lengths, const Vec3& position) {
  ReducedBody body = make_body(rigid_surface_archetype(box_surface(lengths, 0), 1000.0), 0);
  body.position = position;
  return body;
}

/// A rotation that differs for every n.
Quat rotation_of(int n) {
  return Quat(std::cos(1.0 + n), std::sin(2.0 * n), std::cos(3.0 * n + 1.0),
              std::sin(5.0 * n + 2.0))
      .normalized();
}

/// A ball of 1280 faces that lies on one of them at height 0.
ReducedBody resting_ball(double radius, double x, double y) {
  ReducedBody body = ball(radius, Vec3(x, y, 0.0));
  body.position[2] = stand_on_a_face(body);
  return body;
}

/// A slab whose top face passes through the origin, turned about y so that +x goes downhill.
TriMesh slope(double degrees) {
  TriMesh slab = box_surface(Vec3(8.0, 1.0, 0.5), 0);
  const Eigen::AngleAxisd turn(degrees * std::numbers::pi / 180.0, Vec3::UnitY());
  for (Vec3& x : slab.vertices) x = turn * (x - Vec3(0, 0, 0.25));
  return slab;
}

struct SlopeCase {
  double degrees, friction, block_travel, ball_acceleration;
};
// Rows of tests/analytic/reference/incline_friction.csv: closed forms, g = 9.81.
const SlopeCase kSlopes[] = {
    {10, 0.0, 0.8517443115, 1.703488623}, {10, 0.1, 0.3686961086, 1.216777588},
    {20, 0.2, 0.755770342, 2.396584004},  {30, 0.1, 2.027714539, 4.055429079},
    {30, 0.5, 0.3285726972, 3.503571429}, {20, 0.5, 0.0, 2.396584004},
    {45, 0.3, 2.427851133, 4.954798231}};

TEST(Incline, BlockSlidesOrSticksByCoulombsLaw) {
  for (const SlopeCase& c : kSlopes) {
    SimulationOptions o = vacuum(kGravity);
    o.friction = c.friction;
    const double angle = c.degrees * std::numbers::pi / 180.0;
    const Vec3 up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    ReducedBody block = box(Vec3(0.2, 0.2, 0.1), 0.05 * up);
    block.rotation = Eigen::AngleAxisd(angle, Vec3::UnitY());
    Simulation s(o, FluidState(), {block}, {slope(c.degrees)});
    for (int n = 0; n < 100; ++n) s.step(0.01);
    const Vec3 moved = s.bodies()[0].position - block.position;
    // measured: 2e-7 of the travel, 2e-8 m where it sticks; 1 % is the requirement
    EXPECT_NEAR(moved.dot(down), c.block_travel, 1e-4 * c.block_travel + 1e-6)
        << c.degrees << " degrees, friction " << c.friction;
    EXPECT_NEAR(moved.dot(up), 0.0, 1e-6);
  }
}

// The pair's friction is the geometric mean of the two, whatever the scene's is.
TEST(Incline, BodyAndSlopeHaveFrictionOfTheirOwn) {
  const SlopeCase& c = kSlopes[3];
  SimulationOptions o = vacuum(kGravity);
  o.friction = 0.9;
  o.obstacles = {ContactMaterial{0.0, 4.0 * c.friction}};
  const double angle = c.degrees * std::numbers::pi / 180.0;
  const Vec3 up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
  ReducedBody block = box(Vec3(0.2, 0.2, 0.1), 0.05 * up);
  block.rotation = Eigen::AngleAxisd(angle, Vec3::UnitY());
  block.contact = ContactMaterial{0.0, 0.25 * c.friction};
  Simulation s(o, FluidState(), {block}, {slope(c.degrees)});
  for (int n = 0; n < 100; ++n) s.step(0.01);
  EXPECT_NEAR((s.bodies()[0].position - block.position).dot(down), c.block_travel,
              1e-4 * c.block_travel + 1e-6);
}

TEST(Incline, BallRollsDown) {
  for (const SlopeCase& c : {kSlopes[2], kSlopes[5]}) {
    SimulationOptions o = vacuum(kGravity);
    o.friction = c.friction;
    const double angle = c.degrees * std::numbers::pi / 180.0;
    const Vec3 up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    static const auto fine = rigid_surface_archetype(volume_true_sphere(4, 0.1), 1000.0);
    ReducedBody body = make_body(fine, 0);
    body.position = 0.1 * up;
    Simulation s(o, FluidState(), {body}, {slope(c.degrees)});
    for (int n = 0; n < 100; ++n) s.step(0.01);
    const double travel = (s.bodies()[0].position - body.position).dot(down);
    std::printf("rolls %.5f (%.5f)\n", travel, 0.5 * c.ball_acceleration);
    // a polyhedron of 5120 faces rolls over its vertices
    EXPECT_NEAR(travel, 0.5 * c.ball_acceleration, 0.05 * c.ball_acceleration);
  }
}

/// Largest drift over the run after `settle` seconds, and the largest growth of energy in it, as
/// parts of size and of m g size.
struct Rest {
  double drift = 0.0, growth = 0.0, kinetic = 0.0;
};
Rest stay(Simulation& s, double settle, double seconds, double dt, double size) {
  while (s.time() < settle) s.step(std::min(dt, s.stable_dt()));
  const std::vector<ReducedBody> start = s.bodies();
  double weight = 0.0;
  for (const ReducedBody& b : start) weight += body_mass(b) * kGravity * size;
  double energy = INFINITY;
  Rest rest;
  while (s.time() < settle + seconds) {
    const StepReport r = s.step(std::min(dt, s.stable_dt()));
    double now =
        r.body_kinetic + r.body_elastic;  // of the bodies; r.potential counts the water too
    for (const ReducedBody& b : s.bodies()) now += body_mass(b) * kGravity * b.position.z();
    if (energy == INFINITY) energy = now;
    rest.growth = std::max(rest.growth, (now - energy) / weight);
    rest.kinetic = r.body_kinetic / weight;
  }
  for (std::size_t b = 0; b < start.size(); ++b)
    rest.drift = std::max(rest.drift, (s.bodies()[b].position - start[b].position).norm() / size);
  return rest;
}

ReducedBody soft_ring(const Vec3& position) {
  static const SyntheticBody shape = [] {
    SyntheticOptions o;
    o.r = 10;
    o.first_omega = 60.0;
    o.alpha = 20.0;
    return deformable_archetype(torus_tets(0.12, 0.05, 24, 4), o);
  }();
  ReducedBody body = make_body(shape.archetype, 10);
  body.position = position;
  return body;
}

/// A ball and a soft ring on the floor of a dry tank.
Simulation ball_and_ring() {
  SimulationOptions o = dry_tank();
  o.friction = 0.4;
  return Simulation(o, FluidState(),
                    {resting_ball(0.1, 0.25, 0.25), soft_ring(Vec3(0.68, 0.65, 0.052))}, {});
}

void expect_rest(const Rest& rest) {
  std::printf("drift %.2e of the size, energy growth %.2e, kinetic %.2e of m g size\n", rest.drift,
              rest.growth, rest.kinetic);
  EXPECT_LE(rest.drift, 1e-4);
  // gaps rest anywhere within the slack of 1e-4 cells: 1.6e-5 of the size; measured 1e-7 in a
  // minute
  EXPECT_LE(rest.growth, 1e-6);
  EXPECT_LE(rest.kinetic, 1e-8);
}

TEST(RestingBodies, BallAndSoftRingStayDry) {
  Simulation s = ball_and_ring();
  expect_rest(stay(s, 3.0, 3.0, 0.01, 0.2));
}

TEST(SlowRestingBodies, BallAndSoftRingStayDryForAMinute) {
  Simulation s = ball_and_ring();
  expect_rest(stay(s, 3.0, 60.0, 0.01, 0.2));
}

/// The same under 0.7 m of water, both heavier than it.
Simulation sunk_ball_and_ring() {
  SimulationOptions o = dry_tank();
  o.grid = {20, 20, 20, 1.0 / 20, Vec3::Zero()};
  o.open_side[kZMax] = true;
  o.friction = 0.4;
  o.has_water = true;
  o.reference_point = Vec3(0, 0, 0.7);
  std::vector<ReducedBody> bodies = {resting_ball(0.1, 0.25, 0.25),
                                     soft_ring(Vec3(0.68, 0.65, 0.052))};
  for (ReducedBody& b : bodies) b.mass_scale = 2.0;
  return Simulation(o, water_to(o.grid, 0.7), bodies, {});
}

/// After 1.5 s the ring still swings with the water that it has set in motion.
void expect_calm(const Rest& rest) {
  EXPECT_LE(rest.drift, 1e-2);
  EXPECT_LE(rest.growth, 1e-3);
  EXPECT_LE(rest.kinetic, 1e-4);
}

TEST(SlowRestingBodies, BallAndSoftRingAreCalmUnderWater) {
  Simulation s = sunk_ball_and_ring();
  expect_calm(stay(s, 1.5, 1.0, 0.02, 0.2));
}

/// One body, twice as heavy as water, on the floor of a tank of n^3 cells; a small obstacle far
/// from it makes contact between bodies run.
Simulation sunk(ReducedBody body, int n) {
  SimulationOptions o = dry_tank();
  o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
  o.open_side[kZMax] = true;
  o.friction = 0.4;
  o.has_water = true;
  o.reference_point = Vec3(0, 0, 0.7);
  body.mass_scale = 2.0;
  TriMesh obstacle = box_surface(Vec3::Constant(0.02), 0);
  for (Vec3& x : obstacle.vertices) x += Vec3::Constant(0.9);
  return Simulation(o, water_to(o.grid, 0.7), {body}, {obstacle});
}

/// Contacts that press and stick are rows of the coupled solve: measured exactly 0.
TEST(RestingBodies, BallStaysUnderWater) {
  Simulation s = sunk(resting_ball(0.1, 0.45, 0.47), 12);
  expect_rest(stay(s, 0.0, 0.3, 0.02, 0.2));
}

TEST(SlowRestingBodies, BallStaysUnderWaterForAMinute) {
  Simulation s = sunk(resting_ball(0.1, 0.45, 0.47), 12);
  expect_rest(stay(s, 0.0, 60.0, 0.02, 0.2));
}

/// The ring sets water in motion, which dies slowly. Measured: drift 5.47e-05 of the size.
TEST(SlowRestingBodies, SoftRingRestsUnderWaterForAMinute) {
  Simulation s = sunk(soft_ring(Vec3(0.48, 0.45, 0.052)), 16);
  const Rest rest = stay(s, 10.0, 60.0, 0.02, 0.2);
  std::printf("soft ring, 60 s under water: drift %.2e of the size, energy growth %.2e\n",
              rest.drift, rest.growth);
  EXPECT_LE(rest.drift, 1e-4);
  EXPECT_LE(rest.growth, 1e-3);  // in exchange with the waves: measured 2.44e-04
}

Simulation stack_of_five() {
  SimulationOptions o = dry_tank();
  o.friction = 0.4;
  std::vector<ReducedBody> cubes;
  for (int n = 0; n < 5; ++n)
    cubes.push_back(box(Vec3::Constant(0.1), Vec3(0.5, 0.5, 0.05 + 0.1 * n)));
  return Simulation(o, FluidState(), cubes, {});
}

void expect_stack(Simulation& s, double seconds) {
  const std::vector<ReducedBody> start = s.bodies();
  while (s.time() < seconds) s.step(0.01);
  for (int n = 0; n < 5; ++n) {
    const double moved = (s.bodies()[n].position - start[n].position).norm();
    // measured 2e-5 m at the top, most of it in the first steps
    EXPECT_LE(moved, 1e-3 * 0.1) << "cube " << n;
    EXPECT_LE(velocity_of(s.bodies()[n]).norm(), 1e-4);
  }
}

TEST(Stack, FiveCubesStand) {
  Simulation s = stack_of_five();
  expect_stack(s, 2.0);
}

TEST(SlowStack, FiveCubesStandForHalfAMinute) {
  Simulation s = stack_of_five();
  expect_stack(s, 30.0);
}

/// How far momenta are from those of `start`: linear as a part of sum |P|, angular about the
/// origin, of places and of spin, as a part of sum |t x P| + |L|.
struct MomentumError {
  double linear = 0.0, angular = 0.0;
};
MomentumError momentum_error(const StepReport& now, const std::vector<ReducedBody>& start) {
  const Momenta then = momenta_of(start);
  double sum_P = 0.0, sum_L = 0.0;
  for (const ReducedBody& b : start)
    sum_P += b.P.norm(), sum_L += b.position.cross(b.P).norm() + b.L.norm();
  return {(now.body_momentum - then.P).norm() / sum_P,
          (now.body_angular_momentum - then.L).norm() / sum_L};
}

/// Steps of 0.01 s in vacuum; momenta must stay to round-off after every one.
StepReport run_with_constant_momenta(Simulation& s, int steps) {
  constexpr double kRoundOff = 1e-12;
  const std::vector<ReducedBody> start = s.bodies();
  MomentumError largest;
  StepReport r;
  for (int n = 0; n < steps; ++n) {
    r = s.step(0.01);
    const MomentumError error = momentum_error(r, start);
    largest.linear = std::max(largest.linear, error.linear);
    largest.angular = std::max(largest.angular, error.angular);
  }
  std::printf("momentum off by %.2e, angular momentum by %.2e\n", largest.linear, largest.angular);
  // measured at most 4e-16 and 2.2e-15; centres moved without their levers: 2e-6 (cradle) to 1e-2
  EXPECT_LE(largest.linear, kRoundOff);
  EXPECT_LE(largest.angular, kRoundOff);
  return r;
}

double energy_of(const std::vector<ReducedBody>& bodies) {
  double energy = 0.0;
  for (const ReducedBody& b : bodies) energy += kinetic_energy(b) + elastic_energy(b);
  return energy;
}

TEST(Cradle, HandsTheImpactOnAndKeepsMomentum) {
  SimulationOptions o = vacuum(0.0);
  o.restitution = 1.0;
  std::vector<ReducedBody> balls;
  for (int n = 0; n < 5; ++n) balls.push_back(ball(0.1, Vec3(0.2 * n, 0.3, 0.2)));
  balls[0].position[0] = -0.3;
  balls[0].P = balls[0].archetype->integrals.mass * Vec3(1, 0, 0);
  Simulation s(o, FluidState(), balls, {});
  run_with_constant_momenta(s, 60);
  // polyhedra of 1280 faces do not meet quite head-on: measured 2e-4 of the speed
  EXPECT_NEAR(velocity_of(s.bodies()[4])[0], 1.0, 0.01);
  for (int n = 0; n < 4; ++n) EXPECT_LE(velocity_of(s.bodies()[n]).norm(), 0.01) << "ball " << n;
}

/// Two balls that meet off centre, the one spinning.
std::vector<ReducedBody> oblique_balls() {
  std::vector<ReducedBody> balls = {ball(0.1, Vec3(0.1, 0.4, 0.2), Vec3(1.3, 0.2, 0.0)),
                                    ball(0.08, Vec3(0.4, 0.5, 0.25), Vec3(-0.6, 0.0, -0.1))};
  balls[0].L = balls[0].archetype->integrals.mass * Vec3(0.4, -1.0, 2.0) * 0.01;
  return balls;
}

TEST(ObliqueImpact, KeepsMomenta) {
  for (const double restitution : {0.0, 0.6, 1.0})
    for (const double friction : {0.0, 0.4}) {
      SimulationOptions o = vacuum(0.0);
      o.restitution = restitution;
      o.friction = friction;
      const std::vector<ReducedBody> balls = oblique_balls();
      Simulation s(o, FluidState(), balls, {});
      run_with_constant_momenta(s, 40);
      const double before = energy_of(balls), after = energy_of(s.bodies());
      std::printf("restitution %.1f, friction %.1f: energy %+.4f\n", restitution, friction,
                  after / before - 1.0);
      EXPECT_GT((s.bodies()[0].P - balls[0].P).norm(), 0.1 * balls[0].P.norm());  // they met
      EXPECT_LE(after, before * (1.0 + 1e-3));
    }
}

TEST(ObliqueImpact, SoftRingAndBallKeepMomenta) {
  SimulationOptions o = vacuum(0.0);
  o.restitution = 0.3;
  o.friction = 0.4;
  std::vector<ReducedBody> bodies = {soft_ring(Vec3(0.5, 0.5, 0.3)),
                                     ball(0.08, Vec3(0.62, 0.45, 0.6), Vec3(0.2, 0.1, -2.0))};
  bodies[0].rotation = rotation_of(3);
  bodies[0].P = body_mass(bodies[0]) * Vec3(0.0, 0.1, 0.5);
  const std::vector<ReducedBody> start = bodies;
  Simulation s(o, FluidState(), bodies, {});
  run_with_constant_momenta(s, 60);
  const double before = energy_of(start), after = energy_of(s.bodies());
  std::printf("energy %+.4f\n", after / before - 1.0);
  EXPECT_GT((s.bodies()[1].P - start[1].P).norm(), 0.1 * start[1].P.norm());
  EXPECT_LE(after, before * (1.0 + 1e-3));
}

/// Impulses of the position stage at joints take part in the momenta of the step (RATTLE), those at
/// contacts do not.
TEST(ObliqueImpact, JointedBarsAndBallKeepMomenta) {
  SyntheticOptions bar;
  bar.r = 6;
  bar.first_omega = 60.0;
  const SyntheticBody shape =
      deformable_archetype(box_tets(Vec3(0.3, 0.1, 0.1), Vec3i(4, 2, 2)), bar);
  std::vector<ReducedBody> bodies(2, make_body(shape.archetype, 6));
  bodies[0].position = Vec3(0.2, 0.5, 0.3);
  bodies[1].position = Vec3(0.5, 0.5, 0.3);
  const std::vector<Joint> joints = {make_joint(bodies, 0, 1, {Vec3(0.15, 0.0, 0.0)})};
  bodies.push_back(ball(0.08, Vec3(0.58, 0.52, 0.6), Vec3(0.2, 0.1, -2.0)));
  SimulationOptions o = vacuum(0.0);
  o.restitution = 0.3;
  o.friction = 0.4;
  Simulation s(o, FluidState(), bodies, {}, {}, joints);
  const StepReport r = run_with_constant_momenta(s, 60);
  EXPECT_LE(r.joint_drift, 1e-12);
  EXPECT_GT((s.bodies()[2].P - bodies[2].P).norm(), 0.1 * bodies[2].P.norm());
}

TEST(Overlap, BallsHalfInOneAnotherSeparateGently) {
  SimulationOptions o = dry_tank();
  const double a = 0.1;
  Simulation s(o, FluidState(), {ball(a, Vec3(0.4, 0.5, a)), ball(a, Vec3(0.4 + 1.5 * a, 0.5, a))},
               {});
  const double bound = std::sqrt(2.0 * kGravity * a);
  for (int n = 0; n < 100; ++n) {
    const std::vector<ReducedBody> before = s.bodies();
    s.step(0.01);
    for (int b = 0; b < 2; ++b) {
      EXPECT_LE((s.bodies()[b].position - before[b].position).norm() / 0.01, bound);
      EXPECT_LE(velocity_of(s.bodies()[b]).norm(), 0.01 * bound);
    }
  }
  const double apart = (s.bodies()[1].position - s.bodies()[0].position).norm();
  EXPECT_NEAR(apart, 2.0 * a, 0.01 * a);
}

// A ball leaves its place at 1 m/s; another one is due there at once and waits. (It once appeared
// inside the first, and contact flung both away.)
TEST(Overlap, ABodyThatIsDueInAnotherOneWaitsForItsPlace) {
  SimulationOptions o = dry_tank();
  o.gravity = Vec3::Zero();
  const double a = 0.1;
  Archetype shape = *ball(a, Vec3::Zero()).archetype;
  shape.sdf = sample_distance(shape.surface);
  ReducedBody first = make_body(std::make_shared<const Archetype>(shape), 0);
  first.position = Vec3(0.3, 0.5, 0.5);
  ReducedBody second = first;
  first.P = body_mass(first) * Vec3(1, 0, 0);
  Simulation s(o, FluidState(), {first, second}, {}, {0.0, 0.02});
  double fastest = 0.0, appeared = 0.0;
  int late = 0;
  run_to(s, 0.5, 0.01, [&](const StepReport& r) {
    late = std::max(late, s.late_bodies());
    if (s.bodies().size() == 2 && appeared == 0.0) appeared = r.t;
    for (const ReducedBody& b : s.bodies()) fastest = std::max(fastest, velocity_of(b).norm());
  });
  EXPECT_EQ(late, 1);
  EXPECT_EQ(s.late_bodies(), 0);
  // Free when 0.05 of a tenth of the radius overlaps: after 1.995 radii, within a step and facets.
  EXPECT_NEAR(appeared, 1.995 * a, 0.015);
  expect_at_most("speed beyond that of the first body, m/s", fastest - 1.0, 1e-12);
}

/// A heavy ball drives a light one, which was at rest when the step began, into a third: no contact
/// was to be seen there. The step is taken again, shorter.
TEST(Overlap, ABallThatIsDrivenIntoAnotherIsCaughtByShorterSteps) {
  const double radius = 0.05, cell = radius / 8.0;  // without a tank: of the smallest body
  const auto deepest = [&](OnFail on_fail, int* halvings) {
    SimulationOptions o = vacuum(0.0);
    o.on_fail = on_fail;
    Simulation s(o, FluidState(),
                 {ball(0.2, Vec3(-0.251, 0, 0), Vec3(2.0, 0, 0)), ball(radius, Vec3::Zero()),
                  ball(radius, Vec3(0.104, 0, 0))},
                 {});
    double largest = 0.0;
    for (int n = 0; n < 10; ++n) {
      const StepReport r = s.step(0.01);
      largest = std::max(largest, r.max_penetration / cell);
      *halvings += r.halvings;
    }
    return largest;
  };
  int never = 0, halvings = 0;
  const double without = deepest(OnFail::kStop, &never),
               with = deepest(OnFail::kHalveStep, &halvings);
  std::printf("overlap %.3f cells, with %d halvings %.3f\n", without, halvings, with);
  EXPECT_EQ(never, 0);
  EXPECT_GT(without, 1.0);  // there is something to catch: 2 cm, gap 4 mm, cells of 6 mm
  EXPECT_GT(halvings, 0);
  expect_at_most("overlap, cells", with, 0.25);
}

TEST(Overlap, TenCoincidentBallsSplitTheSameWayEveryTime) {
  const auto split = [] {
    std::vector<ReducedBody> balls(10, ball(0.1, Vec3::Zero()));
    Simulation s(vacuum(0.0), FluidState(), balls, {});
    StepReport r;
    for (int n = 0; n < 100; ++n) r = s.step(0.01);
    EXPECT_LE(r.max_penetration, 0.01 * 0.1);
    EXPECT_LE(r.max_speed, std::sqrt(2.0 * kGravity * 0.1));
    return s.bodies();
  };
  const std::vector<ReducedBody> first = split(), second = split();
  for (int n = 0; n < 10; ++n) EXPECT_EQ(first[n].position, second[n].position);
}

// Plates of a fifth of a cell and whatever comes at them by one cell a step, at five places within
// the step: a ball, and a plate that stands on its edge across one that lies, or across its rim.
TEST(ThinParts, StopWhatComesAtThemByACellAStep) {
  constexpr double kDx = 0.05, kThick = 0.2 * kDx, kSpeed = 5.0;
  SimulationOptions o = vacuum(0.0);
  o.grid = {40, 40, 40, kDx, Vec3::Zero()};
  o.wall_contact = false;
  const Vec3 middle(1.0, 1.0, 1.0);
  const ReducedBody plate = box(Vec3(0.6, 0.6, kThick), middle);
  ReducedBody upright = box(Vec3(0.6, 0.6, kThick), Vec3::Zero());
  upright.rotation = Quat(Eigen::AngleAxisd(0.5 * std::numbers::pi, Vec3::UnitY())) *
                     Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  struct Case {
    const char* name;
    ReducedBody comes;
    double reach, aside;  // m
  };
  const double corner = 0.3 * (std::cos(0.3) + std::sin(0.3));  // lowest one of the turned square
  const Case cases[] = {{"ball", ball(0.06, Vec3::Zero()), 0.06, 0.0},
                        {"ball over the rim", ball(0.06, Vec3::Zero()), 0.06, 0.29},
                        {"plate on its corner", upright, corner, 0.0},
                        {"plate on its corner over the rim", upright, corner, 0.29}};
  double deepest_of_all = 0.0;
  for (const Case& c : cases)
    for (int phase = 0; phase < 5; ++phase) {
      ReducedBody comes = c.comes;
      comes.position =
          middle + Vec3(c.aside, 0.01, 0.5 * kThick + c.reach + (2.0 + 0.2 * phase) * kDx);
      comes.P = Vec3(0, 0, -kSpeed * body_mass(comes));
      Simulation s(o, FluidState(), {plate, comes}, {});
      double deepest = 0.0;
      for (int n = 0; n < 8; ++n)
        deepest = std::max(deepest, s.step(kDx / kSpeed).max_penetration / kDx);
      const double apart = velocity_of(s.bodies()[1])[2] - velocity_of(s.bodies()[0])[2];
      if (c.aside == 0.0) {  // a plate that is hit at its rim turns away
        EXPECT_GT(s.bodies()[1].position[2], s.bodies()[0].position[2]) << c.name << ", " << phase;
      }
      EXPECT_GT(velocity_of(s.bodies()[0])[2], -kSpeed) << c.name;
      EXPECT_LT(velocity_of(s.bodies()[0])[2], -0.01) << c.name << ", " << phase << ": was not met";
      EXPECT_LT(deepest, 0.25) << c.name << ", " << phase << ", apart at " << apart;
      deepest_of_all = std::max(deepest_of_all, deepest);
    }
  std::printf("overlap at most %.3f cells\n", deepest_of_all);
}

TEST(ContactCost, NothingWithoutContactAndLittlePerInstance) {
  // no [contact]: no search, no contacts, the same motion as alone
  SimulationOptions o = dry_tank();
  o.body_contact = false;
  Simulation s(o, FluidState(), {ball(0.1, Vec3(0.4, 0.5, 0.1)), ball(0.1, Vec3(0.45, 0.5, 0.1))},
               {});
  const StepReport r = s.step(0.01);
  EXPECT_EQ(r.contact_sweeps, 0);
  EXPECT_EQ(r.max_penetration, 0.0);
  // 150 soft instances against 150 rigid ones: pose and momenta are most of either. Known miss of
  // twice: 3.6 times, as a body keeps its last two shapes [D82]
  const ReducedBody soft = soft_ring(Vec3::Zero());
  ReducedBody rigid = soft;
  rigid.r = 0, rigid.q.resize(0), rigid.q_dot.resize(0);
  EXPECT_LE(instance_bytes(soft), 4 * instance_bytes(rigid));
}

/// Soft bars dropped criss-cross with the weight that they have under water; measured in cells of
/// 1/64 m.
void expect_pile(int count, double seconds) {
  static const SyntheticBody shape = [] {
    SyntheticOptions options;
    options.r = 10;
    options.first_omega = 40.0;
    options.alpha = 10.0;
    return deformable_archetype(box_tets(Vec3(0.3, 0.08, 0.04), Vec3i(10, 3, 2)), options);
  }();
  SimulationOptions o = vacuum(0.5);
  const double dx = 1.0 / 64;
  const int across = static_cast<int>(std::ceil(0.45 * std::sqrt(count / 3.0) / dx));
  o.grid = {across, across, 128, dx, Vec3::Zero()};
  o.open_side[kZMax] = true;
  o.friction = 0.4;
  o.max_dt = 1.0 / 48;
  const int per = static_cast<int>(std::ceil(std::sqrt(count / 3.0)));
  std::vector<ReducedBody> bodies;
  for (int n = 0; n < count; ++n) {
    ReducedBody b = make_body(shape.archetype, 10);
    const int i = n % per, j = n / per % per, layer = n / (per * per);
    b.position =
        Vec3((i + 0.5) * across * dx / per, (j + 0.5) * across * dx / per, 0.2 + 0.35 * layer);
    b.rotation = rotation_of(n);
    bodies.push_back(b);
  }
  Simulation s(o, FluidState(), bodies, {});
  double deepest = 0.0, mean = 0.0, speed = 0.0;
  int settled = 0;
  while (s.time() < seconds) {
    const StepReport r = s.step(s.stable_dt());
    deepest = std::max(deepest, r.max_penetration / dx);
    if (s.time() < 0.8 * seconds) continue;
    ++settled;
    mean += r.mean_penetration / dx;
    for (const ReducedBody& b : s.bodies()) speed += velocity_of(b).norm() / count;
  }
  mean /= settled, speed /= settled;
  std::printf("%d bodies: deepest %.3f cells, at the end mean %.4f cells, mean speed %.2e m/s\n",
              count, deepest, mean, speed);
  EXPECT_LE(deepest, 0.5);
  EXPECT_LE(mean, 0.05);
  EXPECT_LE(speed, 0.01 * std::sqrt(kGravity * 0.3));
}

TEST(Pile, SixSoftBarsComeToRest) { expect_pile(6, 6.0); }
TEST(SlowPile, HundredFiftySoftBarsComeToRest) { expect_pile(150, 10.0); }

}  // namespace
}  // namespace archetide
