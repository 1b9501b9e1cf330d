// Attached points, rows and gaps of joints, and their pre-stabilisation.
#include "runtime/articulation/joint.h"

#include <gtest/gtest.h>

#include "runtime/articulation/pre_stabilisation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

ReducedBody bent_body(unsigned seed, const Vec3& position) {
  const SyntheticBody shape = random_archetype(seed, 4);
  ReducedBody body = make_body(shape.archetype, 4);
  body.position = position;
  body.rotation = Quat(0.8, 0.1 * seed, -0.3, 0.5).normalized();
  body.q = VecX::LinSpaced(4, -0.06, 0.05);
  body.q_dot = VecX::LinSpaced(4, 0.4, -0.7);
  body.P = Vec3(3.0, -2.0, 1.0 * seed);
  body.L = Vec3(0.2, 0.5, -0.3);
  return body;
}

TEST(Attach, ASurfaceVertexMovesAsItself) {
  const ReducedBody body = bent_body(2, Vec3(1, 2, 3));
  for (const int v : {0, 7, 20}) {
    const AttachedPoint p = attach(body, body.archetype->surface.vertices[v]);
    EXPECT_LE((place_of(body, p) - surface_point(body, v)).norm(), 1e-9);
  }
}

TEST(Attach, FieldsThatAreLinearAroundThePointAreExact) {
  // modes that are linear fields, seen from a point inside
  const SyntheticBody shape = random_archetype(5, 2);
  const auto archetype = std::make_shared<Archetype>(*shape.archetype);
  Mat3 G;
  G << 1, 2, -1, 0.5, -2, 1, 3, 0, 1;
  for (std::size_t v = 0; v < archetype->surface.vertices.size(); ++v)
    archetype->surface_modes.col(1).segment<3>(3 * static_cast<long>(v)) =
        G * archetype->surface.vertices[v] + Vec3(0.1, 0.2, 0.3);
  const ReducedBody body = make_body(archetype, 2);
  const Vec3 inside(0.03, -0.05, 0.02);
  const AttachedPoint p = attach(body, inside);
  EXPECT_LE((p.modes.col(1) - (G * inside + Vec3(0.1, 0.2, 0.3))).norm(), 1e-9);
}

TEST(JointRows, AreTheRateOfTheGap) {
  std::vector<ReducedBody> bodies = {bent_body(1, Vec3(0, 0, 0)), bent_body(3, Vec3(0.4, 0.1, 0))};
  const Joint joint = make_joint(bodies, 0, 1, {Vec3(0.2, 0, 0), Vec3(0.1, 0.15, 0)});
  std::vector<ConfigurationTerms> terms;
  for (const ReducedBody& b : bodies)
    terms.push_back(configuration_terms(b, current_configuration(b), ModalMass::kExact));
  const RowBlock rows = joint_rows(joint, {&bodies[0], &bodies[1]}, {&terms[0], &terms[1]});
  const VecX rate = rows.A * generalised_velocity(bodies[0], terms[0]) +
                    rows.B * generalised_velocity(bodies[1], terms[1]);
  // a central difference of free motion, error dt^2
  const double dt = 1e-5;
  std::vector<ReducedBody> ahead = bodies, back = bodies;
  for (int b = 0; b < 2; ++b) {
    const FreeMotion free = {
        terms[b],
        generalised_mass(bodies[b], terms[b], 0.0, Stage::kPositionHalf, ModalStep::kTrapezoid),
        generalised_velocity(bodies[b], terms[b])};
    advance_pose(ahead[b], free, free.y_star, dt);
    advance_pose(back[b], free, free.y_star, -dt);
  }
  const VecX difference = (joint_gap(joint, ahead) - joint_gap(joint, back)) / (2.0 * dt);
  EXPECT_LE((difference - rate).norm(), 1e-7 * rate.norm());
  EXPECT_LE(joint_drift({joint}, bodies), 1e-9);
}

/// `stiff`: per body, whether it keeps its modal rates.
void expect_closed_joints(const std::vector<char>& stiff) {
  std::vector<ReducedBody> bodies = {bent_body(1, Vec3(0, 0, 0)), bent_body(3, Vec3(0.4, 0.1, 0)),
                                     bent_body(2, Vec3(0.8, 0.2, 0))};
  const std::vector<Joint> joints = {
      make_joint(bodies, 0, 1, {Vec3(0.2, 0, 0)}),
      make_joint(bodies, 1, 2, {Vec3(0.2, 0, 0), Vec3(0.1, 0.15, 0), Vec3(0.1, 0, 0.1)}),
      make_joint(bodies, 0, -1, {Vec3(-0.2, 0, 0)})};
  const double dt = 0.01;
  std::vector<FreeMotion> motions;
  std::vector<VecX> y;
  for (const ReducedBody& b : bodies) {
    motions.push_back(free_motion(b, current_configuration(b), VecX::Zero(b.dofs()), dt,
                                  Stage::kPositionHalf, {}));
    y.push_back(motions.back().y_star);
  }
  const std::vector<VecX> start = y;
  const PreStabilised kept = pre_stabilise(joints, bodies, motions, stiff, dt, 1e-13, 1e-8, y);
  EXPECT_TRUE(kept.converged) << kept.drift;
  EXPECT_LE(kept.turns, 15);
  Vec3 total = Vec3::Zero();
  for (int b = 0; b < 3; ++b) {
    const VecX expected = start[b] + motions[b].H.solve(kept.impulse[b]);  // stiff or not
    EXPECT_LE((expected - y[b]).norm(), 1e-12);
    advance_pose(bodies[b], motions[b], y[b], dt);
    if (b > 0) total += kept.impulse[b].head<3>();
  }
  EXPECT_LE(joint_drift(joints, bodies), 1e-13);
  EXPECT_GT(total.norm(), 0.0);
}

TEST(PreStabilisation, ClosesTheJointsAtTheEndOfTheStep) { expect_closed_joints({0, 0, 0}); }

TEST(PreStabilisation, ClosesThemWithoutTheModesOfStiffBodies) { expect_closed_joints({0, 1, 0}); }

// A body that turns by 3 rad about its own centre within the step, hinged to the world far from it:
// nothing near its own motion closes the joint.
TEST(PreStabilisation, GivesUpWhereClosingWouldTakeMoreEnergyThanThereIs) {
  const std::vector<ReducedBody> bodies = {bent_body(1, Vec3(0, 0, 0))};
  const std::vector<Joint> joints = {make_joint(bodies, 0, -1, {Vec3(-0.2, 0, 0)})};
  const double dt = 0.1;
  const std::vector<FreeMotion> motions = {free_motion(bodies[0], current_configuration(bodies[0]),
                                                       VecX::Zero(bodies[0].dofs()), dt,
                                                       Stage::kPositionHalf, {})};
  std::vector<VecX> y = {VecX::Zero(bodies[0].dofs())};
  y[0][5] = 30.0;
  const std::vector<VecX> start = y;
  const PreStabilised kept = pre_stabilise(joints, bodies, motions, {0}, dt, 1e-13, 1e-8, y);
  EXPECT_FALSE(kept.closed);
  EXPECT_EQ(kept.widest, 0);
  EXPECT_LT(kept.turns, 10);
  EXPECT_EQ(y[0], start[0]);
}

}  // namespace
}  // namespace archetide
