// Actuators: balanced forces on points, and what they do to the modes.
#include "runtime/articulation/actuation.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

using Kind = ActuationDirection::Kind;

std::vector<int> first_vertices(int n) {
  std::vector<int> list(n);
  std::iota(list.begin(), list.end(), 0);
  return list;
}

Vec3 resultant(const ActuationPattern& p) {
  return std::accumulate(p.force.begin(), p.force.end(), Vec3(Vec3::Zero()));
}

Vec3 torque_at_rest(const ActuationPattern& p, const Archetype& a) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < p.vertices.size(); ++i)
    sum += a.surface.vertices[p.vertices[i]].cross(p.force[i]);
  return sum;
}

ReducedBody bent_body(const SyntheticBody& synthetic) {
  ReducedBody body = make_body(synthetic.archetype, synthetic.archetype->r());
  body.rotation = Quat(0.8, 0.3, -0.2, 0.4).normalized();
  body.position = Vec3(3, 1, -2);
  body.q = 0.4 * VecX::LinSpaced(body.r, 1.0, -0.5);
  return body;
}

TEST(Actuation, BalancingLeavesNoResultantNoTorqueAndChangesTheLeast) {
  const SyntheticBody synthetic = random_archetype(11, 4);
  const Archetype& a = *synthetic.archetype;
  for (const Kind kind : {Kind::kNormal, Kind::kRadial, Kind::kInward}) {
    const auto points = first_vertices(9);
    const ActuationPattern raw = actuation_pattern(a, points, {kind}, false);
    const ActuationPattern p = actuation_pattern(a, points, {kind}, true);
    EXPECT_LE(resultant(p).norm(), 1e-15);          // measured 8e-17; the forces sum to 1 N
    EXPECT_LE(torque_at_rest(p, a).norm(), 1e-15);  // measured 3e-17 N m
    EXPECT_GT(p.kept, 0.1);
    // the least change is orthogonal to what is left
    double change_times_left = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i)
      change_times_left += (raw.force[i] - p.force[i]).dot(p.force[i]);
    EXPECT_NEAR(change_times_left, 0.0, 1e-16);
  }
}

// J^T f with the surface's own Jacobians, in the deformed and turned configuration.
// Forces act on the material, which the linear modes move.
TEST(Actuation, ModalForceIsTheSumOverThePoints) {
  const SyntheticBody synthetic = linear_alone(random_archetype(11, 4));
  const ReducedBody body = bent_body(synthetic);
  const Configuration at = current_configuration(body);
  const ConfigurationTerms terms = configuration_terms(body, at, ModalMass::kExact);
  for (const bool balanced : {true, false}) {
    Actuator actuator{0, nullptr, 3.0, 0.8, 0.3};
    actuator.pattern = std::make_shared<const ActuationPattern>(
        actuation_pattern(*body.archetype, first_vertices(9), {Kind::kNormal}, balanced));
    const double t = 0.1, now = 3.0 * std::sin(2.0 * EIGEN_PI * t / 0.8 + 0.3);
    VecX sum = VecX::Zero(body.r);
    for (std::size_t i = 0; i < 9; ++i) {
      const MatX J = point_jacobian(body, terms, actuator.pattern->vertices[i]);
      sum += J.rightCols(body.r).transpose() * (body.rotation * (now * actuator.pattern->force[i]));
    }
    const VecX f = modal_force(actuator, t, body, at, terms);
    EXPECT_GT(f.norm(), 1e-3);
    EXPECT_LE((f - sum).norm(), 1e-13 * sum.norm());  // measured 4e-16
  }
}

TEST(Actuation, WhatIsAPushOrATurnIsBalancedAwayWhole) {
  const SyntheticBody synthetic = random_archetype(11, 4);
  const Archetype& a = *synthetic.archetype;
  const ActuationDirection up{Kind::kVector, Vec3(0, 0, 2)};
  EXPECT_LE(actuation_pattern(a, first_vertices(9), up, true).kept, 1e-14);
  EXPECT_LE(actuation_pattern(a, {5}, {Kind::kNormal}, true).kept, 1e-14);
  // two points can be squeezed but not bent
  const ActuationPattern squeeze = actuation_pattern(a, {0, 20}, {Kind::kRadial}, true);
  EXPECT_NEAR(squeeze.kept, 1.0, 1e-14);
  const Vec3 line = a.surface.vertices[20] - a.surface.vertices[0];
  const ActuationDirection across{Kind::kVector, line.cross(Vec3(1, 2, 3))};
  EXPECT_LE(actuation_pattern(a, {0, 20}, across, true).kept, 1e-14);
  // the body's inertia balances anything
  EXPECT_GT(actuation_pattern(a, {5}, up, false).modal.norm(), 1e-3);
}

TEST(Actuation, SineFromStartToEnd) {
  Actuator actuator{0, nullptr, 2.0, 4.0, 0.0};
  actuator.start = 1.0, actuator.end = 3.5;
  EXPECT_EQ(actuator.force_at(0.999), 0.0);
  EXPECT_EQ(actuator.force_at(1.0), 0.0);
  EXPECT_NEAR(actuator.force_at(2.0), 2.0, 1e-15);
  EXPECT_EQ(actuator.force_at(3.6), 0.0);
  actuator.phase = EIGEN_PI;
  EXPECT_NEAR(actuator.force_at(2.0), -2.0, 1e-15);
}

}  // namespace
}  // namespace archetide
