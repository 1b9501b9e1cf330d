// Contact meets the skin, not the bodies under it.
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/simulation.h"
#include "runtime/statistics.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/momenta.h"
#include "tests/support/skinned_bar.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kDensity = 1000.0;  // kg/m^3
constexpr double kDx = 0.05;         // m
constexpr double kHalf = 0.5 * SkinnedBar::kWidth;
const std::vector<double> kHalves = {-0.3, 0.0, 0.3};  // m, ends of the parts

/// A bar of rigid parts under one skin, welded at their cuts; its centre at `place`.
struct Scene {
  SimulationOptions options;
  SkinnedBar bar;
  std::vector<Joint> joints;
  std::vector<ReducedBody> bodies;

  Scene(const std::vector<double>& ends, const Vec3& place,
        const Quat& rotation = Quat::Identity()) {
    options.grid = {40, 20, 40, kDx, Vec3::Zero()};
    options.body_contact = true;
    options.max_dt = 0.01;
    bar = skinned_bar(ends, 0.2, 0.0, 0, kDensity, place, rotation);
    bodies = bar.bodies;
    weld();
  }

  void weld() {
    if (bodies.size() < 2) return;
    std::vector<Vec3> points;
    for (const Vec3& p : {Vec3(0, 0.05, 0.05), Vec3(0, -0.05, 0.05), Vec3(0, 0, -0.05)})
      points.push_back(p - bodies[0].archetype->centre);
    joints = {make_joint(bodies, 0, 1, points)};
  }

  /// As the bar stands: halves turned by +-angle about y, their cut's middle where it was.
  void bend(double angle) {
    for (int b = 0; b < 2; ++b) {
      const Vec3 middle = bodies[b].position - bodies[b].archetype->centre;
      bodies[b].rotation = Quat(Eigen::AngleAxisd(b == 0 ? -angle : angle, Vec3::UnitY()));
      bodies[b].position = middle + bodies[b].rotation * bodies[b].archetype->centre;
    }
    weld();
  }

  void add_ball(double radius, const Vec3& at, const Vec3& velocity) {
    const auto ball = rigid_surface_archetype(volume_true_sphere(4, radius), kDensity);
    ReducedBody body = make_body(ball, 0);
    body.position = at;
    body.P = ball->integrals.mass * velocity;
    bodies.push_back(body);
  }

  Simulation start() const { return Simulation(options, {}, bodies, {}, {}, joints, {bar.skin}); }
};

/// Height of the skin's upper face over x = `x`, y = middle, m: its vertices are straight across.
double skin_top(const Simulation& simulation, double x) {
  std::vector<Vec3> points;
  skin_points(
      simulation.skins()[0], [&](int b) -> const ReducedBody& { return simulation.bodies()[b]; },
      points);
  const TriMesh& surface = simulation.skins()[0].shape->skin->surface;
  double top = -INFINITY;
  for (const Vec3i& t : surface.triangles)
    for (int c = 0; c < 3; ++c) {  // along its edges
      const Vec3 &p = points[t[c]], &q = points[t[(c + 1) % 3]];
      if ((p[0] - x) * (q[0] - x) > 0.0 || p[0] == q[0]) continue;
      const double s = (x - p[0]) / (q[0] - p[0]);
      top = std::max(top, p[2] + s * (q[2] - p[2]));
    }
  return top;
}

/// Share of its speed that a ball keeps which slides without friction over the middle of a bar.
double speed_kept(const std::vector<double>& ends) {
  constexpr double kRadius = 0.06;
  Scene scene(ends, Vec3(1.0, 0.5, kHalf));
  scene.add_ball(kRadius, Vec3(0.85, 0.5, 2.0 * kHalf + kRadius), Vec3(0.4, 0, 0));
  Simulation simulation = scene.start();
  const auto speed_at = [&](double x) {
    while (simulation.bodies().back().position[0] < x) simulation.step(0.01);
    return simulation.bodies().back().P[0] / body_mass(simulation.bodies().back());
  };
  const double before = speed_at(0.95);
  return speed_at(1.05) / before;
}

// A seam is no obstacle. What a ball loses without one is what discrete points of the bar give to a
// round body (a tenth where its turning away from them is not counted); the rims of the cut would
// take 5 %.
TEST(SkinContact, ABallSlidesOverASeam) {
  const double whole = speed_kept({-0.3, 0.3}), cut = speed_kept(kHalves);
  std::printf("speed kept over 0.1 m: %.3f with a seam, %.3f without\n", cut, whole);
  EXPECT_GT(whole, 0.97);
  EXPECT_GT(cut, 0.96);
}

// Bent, the halves leave a notch between them; the skin bridges it, and a ball lies on the skin.
TEST(SkinContact, ABallLiesOnTheSkinOverANotch) {
  constexpr double kRadius = 0.03;
  Scene scene(kHalves, Vec3(1.0, 0.5, 0.5));
  scene.options.wall_contact = false;
  scene.options.gravity = Vec3::Zero();
  scene.bend(0.3);
  Simulation still = scene.start();
  const double top = skin_top(still, 1.0);
  scene.add_ball(kRadius, Vec3(1.0, 0.5, top + kRadius + 0.2 * kDx), Vec3(0, 0, -0.2));
  scene.options.restitution = 0.0;
  Simulation simulation = scene.start();
  while (simulation.time() < 0.3 - 1e-9) simulation.step(0.01);
  const ReducedBody& ball = simulation.bodies()[2];
  const double gap = ball.position[2] - kRadius - skin_top(simulation, ball.position[0]);
  std::printf("over the skin by %+.3f cells, moves at %.3f m/s with a bar at %.3f m/s\n", gap / kDx,
              ball.P[2] / body_mass(ball),
              simulation.bodies()[0].P[2] / body_mass(scene.bodies[0]));
  EXPECT_LT(std::abs(gap), 0.1 * kDx);
}

// What the skin is given its bodies get: P and L of all stay.
TEST(SkinContact, ImpactsKeepMomenta) {
  Scene scene(kHalves, Vec3(1.0, 0.5, 0.5), Quat(0.9, 0.2, -0.3, 0.25).normalized());
  scene.options.wall_contact = false;
  scene.options.gravity = Vec3::Zero();
  scene.options.friction = 0.4;
  scene.options.restitution = 0.5;
  scene.add_ball(0.08, Vec3(1.03, 0.46, 0.8), Vec3(0.2, 0.1, -2.0));
  Simulation simulation = scene.start();
  const Momenta before = momenta_of(simulation.bodies());
  int contacts = 0;
  for (int step = 0; step < 60; ++step) contacts += simulation.step(0.005).contacts;
  const Momenta after = momenta_of(simulation.bodies());
  const double P_off = (after.P - before.P).norm() / before.P.norm(),
               L_off = (after.L - before.L).norm() / before.L.norm();
  std::printf("%d contacts, P off by %.1e, L by %.1e\n", contacts, P_off, L_off);
  EXPECT_GT(contacts, 0);
  EXPECT_LT(P_off, 1e-12);
  EXPECT_LT(L_off, 1e-12);
}

// Without [contact] skins meet the walls as well: the bar lies on the floor, and no deeper.
TEST(SkinContact, ASkinLiesOnTheFloor) {
  Scene scene(kHalves, Vec3(1.0, 0.5, 0.3), Quat(Eigen::AngleAxisd(0.2, Vec3::UnitY())));
  scene.options.body_contact = false;
  Simulation simulation = scene.start();
  while (simulation.time() < 3.0 - 1e-9) simulation.step(0.01);
  std::vector<Vec3> points;
  skin_points(
      simulation.skins()[0], [&](int b) -> const ReducedBody& { return simulation.bodies()[b]; },
      points);
  double lowest = INFINITY, speed = 0.0;
  for (const Vec3& x : points) lowest = std::min(lowest, x[2]);
  for (const ReducedBody& b : simulation.bodies())
    speed = std::max(speed, largest_surface_speed(b));
  std::printf("lowest point %+.2e cells over the floor, speed %.1e m/s\n", lowest / kDx, speed);
  EXPECT_LT(std::abs(lowest), 2e-3 * kDx);  // twice the tolerance of contact
  EXPECT_LT(speed, 1e-6);
}

}  // namespace
}  // namespace archetide
