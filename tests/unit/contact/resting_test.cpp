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

/// Held by the constrained mass, points that the load pulls off released.
Outcome held(const ReducedBody& body, const FreeMotion& stage, const StageContacts& contacts) {
  const MatX all = contact_rows(body, stage.terms, contacts.points);
  const std::vector<int> pressing = pressing_rows(stage.H, all, stage.y_star, contacts.target);
  const MatX rows = all(pressing, Eigen::all);
  const ConstrainedMass mass(stage.H.inverse(), rows, contacts.target(pressing));
  return {mass.project(stage.y_star), rows.transpose() * mass.impulses(stage.y_star)};
}

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

TEST(ConstrainedMass, SolvesTheConstrainedProblemOfTheDenseSystem) {
  const SyntheticBody synthetic = random_archetype(6, 4);
  ReducedBody body = make_body(synthetic.archetype, 4);
  const FreeMotion stage = free_motion(body, current_configuration(body), VecX::Zero(10), 0.01,
                                       Stage::kVelocityFull, ModalOptions{});
  std::vector<ContactPoint> points;
  for (int v : {1, 12, 30}) points.push_back({v, Vec3::UnitZ(), 0.0});
  const MatX C = contact_rows(body, stage.terms, points);
  // [H Cᵀ; C 0] [y; −λ] = [f; 0]
  MatX system = MatX::Zero(13, 13);
  for (int c = 0; c < 10; ++c) system.col(c).head(10) = stage.H.apply(VecX::Unit(10, c));
  system.topRightCorner(10, 3) = C.transpose();
  system.bottomLeftCorner(3, 10) = C;
  VecX right = VecX::Zero(13);
  right.head(10) = VecX::LinSpaced(10, -1.0, 2.0);
  const VecX expected = system.fullPivLu().solve(right).head(10);
  const ConstrainedMass mass(stage.H.inverse(), C);
  EXPECT_LE((mass.solve(right.head(10)) - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LE((C * mass.solve(right.head(10))).norm(), 1e-12 * expected.norm());
}

TEST(ConstrainedMass, TakesRedundantRowsAndIsSymmetric) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 2), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0, 0, 0.1);
  std::vector<Vec3> points;
  surface_points(body, points);
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, wide_floor());
  ASSERT_EQ(contacts.size(), 4u);  // rank 3
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, t, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  const ConstrainedMass mass(H.inverse(), contact_rows(body, t, contacts));
  MatX K(6, 6);
  for (int c = 0; c < 6; ++c) K.col(c) = mass.solve(VecX::Unit(6, c));
  EXPECT_LE((K - K.transpose()).norm(), 1e-14 * K.norm());
  // left: sliding along x and y and turning about z
  EXPECT_NEAR(K(0, 0), 1.0 / H.mass, 1e-14);
  EXPECT_NEAR(K(5, 5), H.inertia_inverse(2, 2), 1e-12);
  EXPECT_LE(K.middleRows(2, 3).norm(), 1e-12);
  // the weight's impulse is shared by the four corners
  VecX y = VecX::Zero(6);
  y[2] = -kGravity * 0.01;
  const VecX lambda = mass.impulses(y);
  EXPECT_NEAR(lambda.sum(), H.mass * kGravity * 0.01, 1e-12);
  EXPECT_NEAR(lambda.minCoeff(), lambda.maxCoeff(), 1e-12);
}

TEST(ConstrainedMass, ReleasesPointsThatTheLoadLifts) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 2), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0, 0, 0.1);
  std::vector<Vec3> points;
  surface_points(body, points);
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, wide_floor());
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, t, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  const MatX rows = contact_rows(body, t, contacts);
  VecX y = VecX::Zero(6);
  y[2] = -0.1;
  EXPECT_EQ(pressing_rows(H, rows, y).size(), 4u);
  y[2] = 0.1;
  EXPECT_TRUE(pressing_rows(H, rows, y).empty());
  // tipping over the edge at +x: the two corners at -x lift off
  y << 0, 0, -0.1, 0, 2.0, 0;
  const std::vector<int> pressing = pressing_rows(H, rows, y);
  ASSERT_EQ(pressing.size(), 2u);
  for (int k : pressing) EXPECT_GT(box->surface.vertices[contacts[k].vertex].x(), 0.0);
}

TEST(Resting, RigidBoxIsAtRestForAThousandSteps) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 2), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0.2, -0.3, 0.1);
  body.rotation = Eigen::AngleAxisd(0.3, Vec3::UnitZ());
  const Vec3 start = body.position;
  std::vector<ContactPoint> resting;
  const VecX force = weight(body, Vec3(0, 0, -kGravity));
  for (int i = 0; i < 1000; ++i) resting = step(body, force, 0.01, wide_floor(), held);
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
  for (int i = 0; i < 1000; ++i) step(body, force, 0.005, wide_floor(), held);
  const ReducedBody settled = body;
  for (int i = 0; i < 1000; ++i) resting = step(body, force, 0.005, wide_floor(), held);
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
