// Bodies against each other and against obstacles, without water.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "runtime/simulation.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

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

Vec3 velocity(const ReducedBody& b) { return b.P / (b.mass_scale * b.archetype->integrals.mass); }

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
const SlopeCase kSlopes[] = {{10, 0.0, 0.8517443115, 1.703488623},
                             {10, 0.1, 0.3686961086, 1.216777588},
                             {20, 0.2, 0.755770342, 2.396584004},
                             {30, 0.1, 2.027714539, 4.055429079},
                             {30, 0.5, 0.3285726972, 3.503571429},
                             {20, 0.5, 0.0, 2.396584004},
                             {45, 0.3, 2.427851133, 4.954798231},
                             {45, 1.0, 0.0, 4.954798231}};

TEST(Incline, BlockSlidesOrSticksAndBallRollsByCoulombsLaw) {
  for (const SlopeCase& c : kSlopes) {
    SimulationOptions o = vacuum(kGravity);
    o.friction = c.friction;
    const double angle = c.degrees * std::numbers::pi / 180.0;
    const Vec3 up(std::sin(angle), 0, std::cos(angle)), down(std::cos(angle), 0, -std::sin(angle));
    ReducedBody block = box(Vec3(0.2, 0.2, 0.1), 0.05 * up);
    block.rotation = Eigen::AngleAxisd(angle, Vec3::UnitY());
    Simulation s(o, FluidState(), {block}, {slope(c.degrees)});
    int sweeps = 0, contacts = 0, most = 0;
    for (int n = 0; n < 100; ++n) { const StepReport r = s.step(0.01); sweeps += r.contact_sweeps; contacts += r.contacts; most = std::max(most, r.contact_sweeps); }
 printf("sweeps %d most %d contacts %d ", sweeps, most, contacts);
    const double travel = (s.bodies()[0].position - block.position).dot(down);
    printf("%g deg mu %g: travel %.6f (%.6f)  lift %.2e\n", c.degrees, c.friction, travel,
           c.block_travel, (s.bodies()[0].position - block.position).dot(up));
    EXPECT_NEAR(travel, c.block_travel, 0.01 * c.block_travel + 1e-6);
  }
}

TEST(Stack, FiveCubesStand) {
  SimulationOptions o = dry_tank();
  o.friction = 0.4;
  std::vector<ReducedBody> cubes;
  for (int n = 0; n < 5; ++n) cubes.push_back(box(Vec3::Constant(0.1), Vec3(0.5, 0.5, 0.05 + 0.1 * n)));
  const std::vector<ReducedBody> start = cubes;
  Simulation s(o, FluidState(), cubes, {});
  int sweeps = 0;
  for (int n = 0; n < 300; ++n) {
    const StepReport r = s.step(0.01);
    sweeps += r.contact_sweeps;
    if (n % 50 == 0) printf("%d: contacts %d sweeps %d kin %.3e pen %.2e\n", n, r.contacts, r.contact_sweeps, r.body_kinetic, r.max_penetration);
  }
  for (int n = 0; n < 5; ++n) {
    printf("%d drift %.3e v %.3e\n", n, (s.bodies()[n].position - start[n].position).norm(),
           velocity(s.bodies()[n]).norm());
    EXPECT_LE((s.bodies()[n].position - start[n].position).norm(), 1e-5);
  }
}

TEST(Cradle, HandsTheImpactOn) {
  SimulationOptions o = vacuum(0.0);
  o.restitution = 1.0;
  std::vector<ReducedBody> balls;
  for (int n = 0; n < 5; ++n) balls.push_back(ball(0.1, Vec3(0.2 * n, 0, 0)));
  balls[0].position[0] = -0.3;
  balls[0].P = balls[0].archetype->integrals.mass * Vec3(1, 0, 0);
  Simulation s(o, FluidState(), balls, {});
  StepReport r;
  const double before = balls[0].P[0];
  for (int n = 0; n < 100; ++n) r = s.step(0.01);
  for (int n = 0; n < 5; ++n) {
    const Vec3 v = velocity(s.bodies()[n]);
    printf("%d: x %.5f v %.6f %.2e %.2e\n", n, s.bodies()[n].position[0], v[0], v[1], v[2]);
  }
  printf("momentum error %.2e\n", r.body_momentum[0] / before - 1.0);
}

TEST(Overlap, SeparatesGently) {
  SimulationOptions o = vacuum(kGravity);
  o.gravity = Vec3(0, 0, -1e-9);
  const double a = 0.1;
  Simulation s(o, FluidState(), {ball(a, Vec3(0, 0, 0)), ball(a, Vec3(1.5 * a, 0, 0))}, {});
  for (int n = 0; n < 100; ++n) {
    const Vec3 x = s.bodies()[1].position;
    const StepReport r = s.step(0.01);
    if (n % 10 == 0) printf("%d dist %.5f speed %.4f kin %.3e pen %.3e\n", n, (s.bodies()[1].position - s.bodies()[0].position).norm(), (s.bodies()[1].position - x).norm() / 0.01, r.body_kinetic, r.max_penetration);
  }
}

TEST(Overlap, TenCoincident) {
  SimulationOptions o = vacuum(0.0);
  const double a = 0.1;
  std::vector<ReducedBody> balls(10, ball(a, Vec3::Zero()));
  Simulation s(o, FluidState(), balls, {});
  for (int n = 0; n < 200; ++n) {
    const StepReport r = s.step(0.01);
    if (n % 20 == 0) printf("%d kin %.3e pen %.3e contacts %d sweeps %d\n", n, r.body_kinetic, r.max_penetration, r.contacts, r.contact_sweeps);
  }
}

}  // namespace
}  // namespace archetide
#include "common/archetype.h"
#include <chrono>
namespace archetide {
namespace {
TEST(SlowPile, Starfish) {
  const int count = getenv("N") ? atoi(getenv("N")) : 30;
  const int modes = getenv("R") ? atoi(getenv("R")) : 20;
  const double seconds = getenv("T") ? atof(getenv("T")) : 3;
  auto star = std::make_shared<const Archetype>(read_archetype("/tmp/w/contact_out/starfish.h5", Part::kRuntime));
  SimulationOptions o;
  const double dx = 1.0 / 64;
  const int side = int(std::ceil(std::sqrt(count / 150.0 * 224.0 * 352.0)));
  o.grid = {side, side, 128, dx, Vec3::Zero()};
  o.open_side[kZMax] = true;
  o.body_contact = true;
  o.friction = 0.4;
  o.restitution = 0.1;
  o.max_dt = 1.0 / 24;
  if (getenv("G")) o.gravity = Vec3(0, 0, -atof(getenv("G")));
  std::vector<ReducedBody> bodies;
  srand(3);
  const double L = side * dx;
  const int per = int(std::sqrt(count / 3.0)) + 1;
  for (int n = 0; n < count; ++n) {
    ReducedBody b = make_body(star, modes);
    const int layer = n / (per * per), i = n % per, j = n / per % per;
    b.position = Vec3((i + 0.5) * L / per, (j + 0.5) * L / per, 0.3 + 0.4 * layer);
    b.rotation = Quat(Eigen::Vector4d::Random()).normalized();
    bodies.push_back(b);
  }
  printf("L %.2f per %d\n", L, per);
  Simulation s(o, FluidState(), bodies, {});
  double next = 0, worst = 0;
  int steps = 0; long sweeps = 0;
  auto start = std::chrono::steady_clock::now();
  while (s.time() < seconds) {
    const StepReport r = s.step(s.stable_dt());
    ++steps; sweeps += r.contact_sweeps;
    worst = std::max(worst, r.max_penetration);
    if (s.time() >= next) {
      next += seconds / 20;
      double mean = 0;
      for (auto& b : s.bodies()) mean += velocity(b).norm() / count;
      printf("t %.3f dt %.4f contacts %d sweeps %d pen %.3f (worst %.3f) mean %.4f cells  v %.2e  E %.4f defo %.2f  %.2f s\n", s.time(), r.dt, r.contacts, r.contact_sweeps, r.max_penetration / dx, worst / dx, r.mean_penetration / dx, mean, r.body_kinetic + r.body_elastic + r.potential, r.max_deformation,
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
      fflush(stdout);
    }
  }
  printf("steps %d sweeps %ld; ", steps, sweeps);
  for (auto& p : s.profile().phases()) printf("%s %.2f  ", p.c_str(), s.profile().seconds(p));
  printf("\n");
}
}
}
