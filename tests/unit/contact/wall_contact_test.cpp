// Impacts on the tank's walls: momentum, energy, restitution, corners.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "runtime/contact/wall_contact.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

WallContactOptions unit_tank() {
  WallContactOptions o;
  o.low = Vec3::Zero();
  o.high = Vec3::Ones();
  o.closed.fill(true);
  o.tolerance = 1e-5;
  return o;
}

/// A soft blob that has run into the floor, spinning and vibrating.
ReducedBody falling_blob(const SyntheticBody& synthetic) {
  ReducedBody body = make_body(synthetic.archetype, synthetic.archetype->r());
  body.rotation = Quat(0.9, 0.2, -0.3, 0.1).normalized();
  body.position = Vec3(0.5, 0.5, 0.2);
  body.P = body.archetype->integrals.mass * Vec3(0.4, -0.2, -1.5);
  body.L = Vec3(0.3, -0.5, 0.2);
  body.q = 0.05 * VecX::Ones(body.r);
  body.q_dot = VecX::LinSpaced(body.r, -0.5, 0.5);
  return body;
}

TEST(WallContacts, AreTheVerticesAtTheWallsAndNoOthers) {
  const std::vector<Vec3> points = {{0.5, 0.5, -0.01}, {0.5, 0.5, 2e-5}, {1.2, 0.5, 0.5}};
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, unit_tank());
  ASSERT_EQ(contacts.size(), 2u);
  EXPECT_EQ(contacts[0].vertex, 2);
  EXPECT_EQ(contacts[0].normal, Vec3(-1, 0, 0));
  EXPECT_NEAR(contacts[0].gap, -0.2, 1e-15);
  EXPECT_EQ(contacts[1].vertex, 0);
  EXPECT_NEAR(contacts[1].gap, -0.01, 1e-15);
}

TEST(WallContacts, OpenSidesLetBodiesThrough) {
  WallContactOptions o = unit_tank();
  o.closed[kXMax] = false;
  EXPECT_TRUE(find_wall_contacts({Vec3(1.2, 0.5, 0.5)}, o).empty());
}

TEST(WallContacts, OfAFlatBoxAreItsFourCorners) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 3), 1000.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0.5, 0.5, 0.1);
  std::vector<Vec3> points;
  surface_points(body, points);
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, unit_tank());
  ASSERT_EQ(contacts.size(), 4u);
  std::set<std::pair<double, double>> corners;
  for (const ContactPoint& c : contacts) {
    const Vec3 x = box->surface.vertices[c.vertex];
    corners.insert({std::copysign(1.0, x.x()), std::copysign(1.0, x.y())});
    EXPECT_NEAR(std::abs(x.x()), 0.2, 1e-12);
    EXPECT_NEAR(std::abs(x.y()), 0.15, 1e-12);
  }
  EXPECT_EQ(corners.size(), 4u);
}

TEST(WallContacts, AreFewHoweverFineTheSurface) {
  const auto sphere = rigid_surface_archetype(icosphere(5, 0.3), 1000.0);
  ReducedBody body = make_body(sphere, 0);
  body.position = Vec3(0.5, 0.5, 0.2);
  std::vector<Vec3> points;
  surface_points(body, points);
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, unit_tank());
  EXPECT_LE(contacts.size(), static_cast<std::size_t>(kMaxPointsPerSide));
  // the deepest one is among them, first
  EXPECT_NEAR(contacts.front().gap, -0.1, 1e-12);
}

TEST(WallContacts, FarBodiesAreSkippedAndNoNearOneIs) {
  const SyntheticBody synthetic = random_archetype(3, 4);
  const BodyReach reach = body_reach(*synthetic.archetype);
  ReducedBody body = make_body(synthetic.archetype, 4);
  body.q = 0.3 * VecX::Ones(4);
  WallContactOptions o = unit_tank();
  o.low = Vec3::Constant(-3);
  o.high = Vec3::Constant(3);
  EXPECT_TRUE(away_from_walls(body, reach, o));
  for (double z = 0.0; z > -3.5; z -= 0.05) {
    body.position.z() = z;
    std::vector<Vec3> points;
    surface_points(body, points);
    EXPECT_FALSE(away_from_walls(body, reach, o) && !find_wall_contacts(points, o).empty());
  }
  EXPECT_FALSE(away_from_walls(body, reach, o));
}

TEST(Impact, GivesTheWallExactlyTheMomentumThatTheBodyLoses) {
  const SyntheticBody synthetic = random_archetype(9, 5);
  for (double friction : {0.0, 0.4}) {
    ReducedBody body = falling_blob(synthetic);
    const ReducedBody before = body;
    WallContactOptions o = unit_tank();
    o.friction = friction;
    o.restitution = 0.3;
    const WallContactResult result = resolve_wall_contacts(body, o);
    EXPECT_GT(result.contacts, 1);
    EXPECT_LT(result.wall_impulse.z(), -1.0);
    // the one sum enters P and the wall with opposite signs; measured 0
    EXPECT_LE((body.P + result.wall_impulse - before.P).norm(), 1e-14 * before.P.norm());
    if (friction == 0.0) {
      EXPECT_EQ(result.wall_impulse.x(), 0.0);
      EXPECT_NEAR(body.L.z(), before.L.z(), 1e-14);
    }
  }
}

// A ball bounces by the larger restitution of the two, its own or the wall's.
TEST(Impact, BodyBouncesByItsOwnMaterial) {
  const auto ball = rigid_surface_archetype(icosphere(3, 0.1), 1000.0);
  const auto rebound = [&](std::optional<ContactMaterial> own) {
    ReducedBody body = make_body(ball, 0);
    body.position = Vec3(0.5, 0.5, 0.0999);
    body.P = Vec3(0, 0, -2.0 * body_mass(body));
    body.contact = own;
    WallContactOptions o = unit_tank();
    o.restitution = 0.3;
    resolve_wall_contacts(body, o);
    return body.P.z() / body_mass(body);
  };
  EXPECT_NEAR(rebound(std::nullopt), 0.6, 1e-12);
  EXPECT_NEAR(rebound(ContactMaterial{0.9, 0.0}), 1.8, 1e-12);
  EXPECT_NEAR(rebound(ContactMaterial{0.0, 0.0}), 0.6, 1e-12);
}

TEST(Impact, LeavesNoPointApproachingAndNoneBeyondTheWall) {
  const SyntheticBody synthetic = random_archetype(9, 5);
  ReducedBody body = falling_blob(synthetic);
  std::vector<Vec3> points;
  surface_points(body, points);
  WallContactOptions o = unit_tank();
  o.friction = 0.3;
  const std::vector<ContactPoint> contacts = find_wall_contacts(points, o);
  resolve_wall_contacts(body, o);
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  for (const ContactPoint& c : contacts)
    EXPECT_GE(c.normal.dot(surface_velocity(body, t, c.vertex)), -1e-11);  // measured -3e-16
  surface_points(body, points);
  for (const Vec3& x : points) EXPECT_GE(x.z(), -1e-15);
  EXPECT_LE(kinetic_energy(body), kinetic_energy(falling_blob(synthetic)));
}

TEST(Impact, OfAStiffBodyOverAStepLosesEnergyOnlyAndMovesItsModesLittle) {
  SyntheticOptions options;
  options.r = 5;
  options.first_omega = 1e6;
  const SyntheticBody synthetic =
      deformable_archetype(blob_tets(9, Vec3(0.5, 0.4, 0.3), Vec3i(3, 3, 3)), options);
  ReducedBody body = falling_blob(synthetic);
  body.q.setZero();
  body.q_dot.setZero();
  const double before = kinetic_energy(body);
  WallContactOptions o = unit_tank();
  o.dt = 0.01;
  resolve_wall_contacts(body, o);
  EXPECT_LE(kinetic_energy(body), before);
  // impulse 1e2 N s over M̂ = dt² ω² / 4 kg = 2.5e7 kg
  EXPECT_LE(body.q_dot.norm(), 1e-5);
}

TEST(Impact, FullRestitutionKeepsTheEnergyOfARigidSphere) {
  const auto sphere = rigid_surface_archetype(icosphere(3, 0.2), 1000.0);
  ReducedBody body = make_body(sphere, 0);
  body.position = Vec3(0.5, 0.5, 0.195);
  body.P = sphere->integrals.mass * Vec3(0, 0, -2);
  const double before = kinetic_energy(body);
  WallContactOptions o = unit_tank();
  o.restitution = 1.0;
  const WallContactResult result = resolve_wall_contacts(body, o);
  EXPECT_NEAR(kinetic_energy(body), before, 1e-12 * before);
  EXPECT_NEAR(body.P.z(), 2.0 * sphere->integrals.mass, 1e-12 * body.P.z());
  EXPECT_GE(result.contacts, 1);
}

TEST(Impact, SlowApproachDoesNotBounce) {
  const auto sphere = rigid_surface_archetype(icosphere(3, 0.2), 1000.0);
  ReducedBody body = make_body(sphere, 0);
  body.position = Vec3(0.5, 0.5, 0.2);
  body.P = sphere->integrals.mass * Vec3(0, 0, -0.01);
  WallContactOptions o = unit_tank();
  o.restitution = 1.0;
  o.resting_speed = 0.02;
  const WallContactResult result = resolve_wall_contacts(body, o);
  EXPECT_LE(std::abs(body.P.z()), 1e-14);
  EXPECT_EQ(result.velocity_stage.points.size(), 1u);
}

TEST(Impact, BoxDroppedFlatDoesNotSpin) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(0.4, 0.3, 0.2), 3), 700.0);
  for (double restitution : {0.0, 0.5}) {
    ReducedBody body = make_body(box, 0);
    body.position = Vec3(0.5, 0.4, 0.09);
    body.P = box->integrals.mass * Vec3(0, 0, -2);
    WallContactOptions o = unit_tank();
    o.friction = 0.5;
    o.restitution = restitution;
    resolve_wall_contacts(body, o);
    // Gauss-Seidel stops at 1e-14 of the speed; the scale of L is m v L = 13; measured L 1e-15, P
    // 2e-14
    EXPECT_LE(body.L.norm(), 1e-11);
    EXPECT_NEAR(body.P.z(), restitution * 2.0 * box->integrals.mass, 1e-11);
    EXPECT_NEAR(body.position.z(), 0.1, 1e-14);
  }
}

TEST(Impact, BodyPushedIntoACornerStopsAndComesOut) {
  const SyntheticBody synthetic = random_archetype(4, 4);
  ReducedBody body = falling_blob(synthetic);
  body.position = Vec3(0.1, 0.15, 0.1);
  body.P = body.archetype->integrals.mass * Vec3(-1, -2, -1);
  const WallContactResult result = resolve_wall_contacts(body, unit_tank());
  std::vector<Vec3> points;
  surface_points(body, points);
  Vec3 low = points[0];
  for (const Vec3& x : points) low = low.cwiseMin(x);
  EXPECT_LE(low.cwiseAbs().maxCoeff(), 1e-14);  // touches all three walls
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(result.wall_impulse[axis], 0.0);
}

TEST(Impact, BodyWiderThanTheTankIsCentred) {
  const auto box = rigid_surface_archetype(box_surface(Vec3(1.2, 0.3, 0.2), 2), 700.0);
  ReducedBody body = make_body(box, 0);
  body.position = Vec3(0.45, 0.5, 0.5);
  resolve_wall_contacts(body, unit_tank());
  EXPECT_NEAR(body.position.x(), 0.5, 1e-14);
}

TEST(Impact, FarBodyIsUntouched) {
  const auto sphere = rigid_surface_archetype(icosphere(2, 0.2), 1000.0);
  ReducedBody body = make_body(sphere, 0);
  body.position = Vec3::Constant(0.5);
  body.P = Vec3(0, 0, -100);
  const WallContactResult result = resolve_wall_contacts(body, unit_tank());
  EXPECT_EQ(result.contacts, 0);
  EXPECT_EQ(body.P, Vec3(0, 0, -100));
  EXPECT_EQ(body.position, Vec3::Constant(0.5));
}

}  // namespace
}  // namespace archetide
