// Bodies that stay at a wall: rest, friction, release.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "runtime/contact/wall_contact.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kGravity = 9.81;

WallContactOptions wide_floor() {
  WallContactOptions o;
  o.low = Vec3(-100, -100, 0);
  o.high = Vec3::Constant(100);
  o.closed.fill(true);
  o.tolerance = 1e-5;
  return o;
}

VecX weight(const ReducedBody& body, const Vec3& gravity) {
  VecX f = VecX::Zero(body.dofs());
  f.head<3>() = body_mass(body) * gravity;
  return f;
}

/// One stage's outcome: y and the generalised impulse of the walls, 6 + r both.
struct Outcome {
  VecX y, impulse;
};

/// Unilateral, frictional contact.
struct Rubbed {
  double friction;
  Outcome operator()(const ReducedBody& body, const FreeMotion& stage,
                     const StageContacts& contacts) const {
    const MatX normals = contact_rows(body, stage.terms, contacts.points);
    const MatX tangents = tangent_rows(body, stage.terms, contacts.points);
    VecX y = stage.y_star;
    const ContactImpulses impulses =
        push_apart(stage.H, normals, tangents, contacts.target, friction, y);
    return {y, generalised_impulse(normals, tangents, impulses)};
  }
};

/// Section 6 without water: position stage, contact, velocity stage. Returns the points at rest.
template <class Contact>
std::vector<ContactPoint> step(ReducedBody& body, const VecX& force, double dt,
                               WallContactOptions walls, const Contact& contact) {
  walls.dt = dt;
  const FreeMotion half =
      free_motion(body, current_configuration(body), force, dt, Stage::kPositionHalf, walls.modal);
  const StageContacts ahead = reachable_wall_contacts(body, half, dt, walls);
  const Configuration mid = advance_pose(body, half, contact(body, half, ahead).y, dt);
  const WallContactResult met = resolve_wall_contacts(body, walls, ahead.points);
  const FreeMotion full = free_motion(body, mid, force, dt, Stage::kVelocityFull, walls.modal);
  const Outcome outcome = contact(body, full, met.velocity_stage);
  const VecX gained = dt * force + outcome.impulse;
  accept_velocity(body, outcome.y, gained.head<3>(), gained.segment<3>(3));
  return met.velocity_stage.points;
}

double speed(const ReducedBody& body) {
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  return generalised_velocity(body, t).norm();
}

TEST(Resting, RigidBoxIsAtRestForAThousandSteps) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 2), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0.2, -0.3, 0.1);
  body.rotation = Eigen::AngleAxisd(0.3, Vec3::UnitZ());
  const Vec3 start = body.position;
  std::vector<ContactPoint> resting;
  const VecX force = weight(body, Vec3(0, 0, -kGravity));
  for (int i = 0; i < 1000; ++i) resting = step(body, force, 0.01, wide_floor(), Rubbed{0.0});
  // the first position stage knows no contact yet: it falls g dt²/2 and is pushed out. Measured
  // below 1e-14
  EXPECT_EQ(resting.size(), 4u);
  EXPECT_LE(speed(body), 1e-10);
  EXPECT_LE((body.position - start).norm(), 1e-9);
  EXPECT_LE(body.rotation.angularDistance(Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()))), 1e-9);
}

TEST(Resting, SoftBodySettlesAndIsThenAtRest) {
  SyntheticOptions options;
  options.r = 6;
  options.first_omega = 60.0;
  options.alpha = 20.0;
  const SyntheticBody synthetic =
      deformable_archetype(box_tets(Vec3(0.4, 0.3, 0.2), Vec3i(4, 3, 2)), options);
  ReducedBody body = make_body(synthetic.archetype, 6);
  body.position = Vec3(0, 0, 0.1);
  std::vector<ContactPoint> resting;
  const VecX force = weight(body, Vec3(0, 0, -kGravity));
  for (int i = 0; i < 1000; ++i) step(body, force, 0.005, wide_floor(), Rubbed{0.0});
  const ReducedBody settled = body;
  for (int i = 0; i < 1000; ++i) resting = step(body, force, 0.005, wide_floor(), Rubbed{0.0});
  EXPECT_GE(resting.size(), 3u);
  EXPECT_GT(body.q.norm(), 1e-4);  // it does sag
  EXPECT_LE(speed(body), 1e-10);
  EXPECT_LE((body.position - settled.position).norm(), 1e-9);
  EXPECT_LE((body.q - settled.q).norm(), 1e-9);
}

TEST(Resting, FrictionStopsASlidingBoxAfterItsDistance) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.1), 1), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0, 0, 0.05);
  const double v = 2.0, mu = 0.3, dt = 0.005;
  body.P = box->integrals.mass * Vec3(v, 0, 0);
  WallContactOptions walls = wide_floor();
  walls.friction = mu;
  const VecX force = weight(body, Vec3(0, 0, -kGravity));
  for (int i = 0; i < 200; ++i) step(body, force, dt, walls, Rubbed{mu});
  // v² / (2 μ g) = 0.6796 m after 0.68 s; uniform deceleration is exact but for the last step, at
  // most μ g dt² / 2 = 4e-5
  EXPECT_NEAR(body.position.x(), v * v / (2 * mu * kGravity), 4e-5);
  EXPECT_LE(speed(body), 1e-10);
  EXPECT_NEAR(body.position.y(), 0.0, 1e-10);
}

TEST(Resting, BoxOnASlopeStaysOrSlidesByCoulombsLaw) {
  // slope 10 degrees, tan = 0.176: travel after 1 s, g (sin − μ cos) / 2
  for (const auto& [mu, travel] : {std::pair(0.1, 0.3686961086), std::pair(0.2, 0.0)}) {
    const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.1), 1), 700.0);
    ReducedBody body = make_body(box, 0);
    body.position = Vec3(0, 0, 0.05);
    WallContactOptions walls = wide_floor();
    walls.friction = mu;
    const double angle = 10.0 * 3.14159265358979323846 / 180.0;
    const VecX force = weight(body, kGravity * Vec3(std::sin(angle), 0, -std::cos(angle)));
    for (int i = 0; i < 100; ++i) step(body, force, 0.01, walls, Rubbed{mu});
    EXPECT_NEAR(body.position.x(), travel, 1e-9);
    EXPECT_LE(body.L.norm(), 1e-9);
  }
}

}  // namespace
}  // namespace archetide
