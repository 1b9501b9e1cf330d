// Bodies of nodes: every degree of freedom of the tets, S = 1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "runtime/solid/nodal_rows.h"
#include "tests/support/dry_body.h"
#include "tests/support/full_blob.h"

namespace archetide {
namespace {

/// Spins and vibrates; the same motion with nodes as with modes.
void set_moving(ReducedBody& body, const MatX& modes) {
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.rotation = Quat(0.8, 0.3, -0.2, 0.4).normalized();
  body.P = body_mass(body) * Vec3(0.3, -0.1, 0.2);
  body.L = t.inertia * Vec3(1.0, 1.5, -1.2);
  const VecX share = VecX::LinSpaced(modes.cols(), 1.0, -0.5);
  body.q = 2e-3 * (modes * share);
  body.q_dot = 0.02 * (modes * share.reverse());
}

struct Twins {
  ReducedBody with_modes, with_nodes;
};
Twins twins(const FullBlob& blob) {
  const int r = blob.archetype->r();
  Twins t{body_of_modes(blob), body_of_nodes(blob)};
  t.with_modes.mass_scale = t.with_nodes.mass_scale = 1.5;
  set_moving(t.with_modes, MatX::Identity(r, r));
  set_moving(t.with_nodes, blob.archetype->node_modes);
  return t;
}

/// Of the size of the body.
double relative_distance(const ReducedBody& a, const ReducedBody& b) {
  return largest_distance(a, b) / 0.5;
}

TEST(BlockCholesky, SolvesWithMassAndStiffnessInAnyOrderOfElimination) {
  const FullBlob blob;
  const double ratio = 3e-3;
  const MatX A = blob.fem.mass() + ratio * blob.fem.K;
  std::srand(1);
  const MatX exact = MatX::Random(A.rows(), 40);
  MatX x = A * exact;
  blob.nodes->factor(ratio)->solve(x);
  // round-off times the condition of A, about 1e3
  EXPECT_LT((x - exact).norm(), 1e-12 * exact.norm());
}

TEST(BlockCholesky, MergedSupernodesHoldAllOfALargerFactor) {
  const TetMesh tets = box_tets(Vec3(1.0, 0.3, 0.3), Vec3i(12, 3, 3));
  const SmallFem fem = small_fem(tets, 400.0, 2e4, 0.4);
  std::vector<int> order(tets.nodes.size());
  std::iota(order.begin(), order.end(), 0);
  const TetMatrices m = sparse_matrices(tets, fem, order);
  const auto pattern = std::make_shared<const FactorPattern>(m);
  EXPECT_LT(pattern->supernodes().size(), tets.nodes.size() / 4);
  const MatX A = fem.mass() + 1e-3 * fem.K;
  MatX x = A * MatX::Ones(A.rows(), 1);
  BlockCholesky(pattern, m, 1e-3).solve(x);
  EXPECT_LT((x - MatX::Ones(A.rows(), 1)).cwiseAbs().maxCoeff(), 1e-12);
}

// More columns than are solved for at once, on both sides of a separator and on it, some of two
// nodes.
TEST(BlockCholesky, ComplianceIsThatOfWholeSolutions) {
  const TetMesh tets = box_tets(Vec3(1.0, 0.3, 0.3), Vec3i(12, 3, 3));
  const SmallFem fem = small_fem(tets, 400.0, 2e4, 0.4);
  const int n = static_cast<int>(tets.nodes.size());
  const auto part = [&](int p) {  // left, right, middle
    const double x = tets.nodes[p][0] - tets.nodes[0][0] - 0.5;
    return x < -1e-6 ? 0 : x > 1e-6 ? 1 : 2;
  };
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int p, int q) { return part(p) < part(q); });
  const TetMatrices m = sparse_matrices(tets, fem, order);
  const BlockCholesky factor(std::make_shared<const FactorPattern>(m), m, 1e-3);
  Eigen::SparseMatrix<double> E(3L * n, 130);
  for (int k = 0; k < E.cols(); ++k) {
    E.insert(3 * ((7 * k) % n) + k % 3, k) = 1.0 + 0.1 * k;
    if (k % 4 == 0) E.insert(3 * ((11 * k + 5) % n) + (k + 1) % 3, k) = -0.5;
  }
  MatX answers = E;
  factor.solve(answers);
  const MatX wanted = E.transpose() * answers, got = factor.compliance(E);
  EXPECT_LT((got - wanted).norm(), 1e-13 * wanted.norm());
  EXPECT_EQ(got, MatX(got.transpose()));
}

TEST(FullBody, ConfigurationIsThatOfAllModes) {
  const Twins t = twins(FullBlob());
  const auto terms = [](const ReducedBody& body) {
    return configuration_terms(body, current_configuration(body), ModalMass::kExact);
  };
  const ConfigurationTerms modal = terms(t.with_modes), nodal = terms(t.with_nodes);
  EXPECT_LT((modal.inertia - nodal.inertia).norm(), 1e-13 * modal.inertia.norm());
  EXPECT_NEAR(modal.shape.s, nodal.shape.s, 1e-14);
  EXPECT_LT((modal.shape.shift - nodal.shape.shift).norm(), 1e-14);
  const MatX& S = t.with_nodes.archetype->node_modes;
  EXPECT_LT((modal.D - nodal.D * S).norm(), 1e-12 * modal.D.norm());
  EXPECT_LT((modal.shape.slope - S.transpose() * nodal.shape.slope).norm(),
            1e-12 * modal.shape.slope.norm());
  EXPECT_LT((modal.shape.shift_rate - nodal.shape.shift_rate * S).norm(),
            1e-12 * modal.shape.shift_rate.norm());
  EXPECT_NEAR(kinetic_energy(t.with_modes), kinetic_energy(t.with_nodes),
              1e-12 * kinetic_energy(t.with_modes));
  EXPECT_NEAR(elastic_energy(t.with_modes), elastic_energy(t.with_nodes),
              1e-12 * elastic_energy(t.with_modes));
}

TEST(FullBody, MovesAsWithAllModesFor200Steps) {
  for (const ModalStep rule : {ModalStep::kTrapezoid, ModalStep::kBackwardEuler})
    for (const ModalMass mass : {ModalMass::kExact, ModalMass::kPaper}) {
      Twins t = twins(FullBlob());
      dry_steps(t.with_modes, 200, 0.01, {rule, mass});
      dry_steps(t.with_nodes, 200, 0.01, {rule, mass});
      EXPECT_LT(relative_distance(t.with_modes, t.with_nodes), 1e-10);
      EXPECT_LT((t.with_modes.q_dot - t.with_nodes.archetype->node_modes.transpose() *
                                          t.with_nodes.nodes->product(1.0, 0.0, t.with_nodes.q_dot))
                    .norm(),
                1e-8 * t.with_modes.q_dot.norm());
    }
}

TEST(FullBody, KeepsItsMomentaAndNoRigidMotionInItsNodes) {
  Twins t = twins(FullBlob());
  ReducedBody& body = t.with_nodes;
  const Vec3 P = body.P, L = body.L;
  dry_steps(body, 200, 0.01, {});
  EXPECT_EQ(body.P, P);
  EXPECT_EQ(body.L, L);
  MatX rigid = body.q;
  body.nodes->take_rigid_motion(rigid);
  EXPECT_LT((rigid - body.q).norm(), 1e-13 * body.q.norm());
}

TEST(FullBody, FactorsOfAFewStepLengthsAreKept) {
  const FullBlob blob;
  const auto first = blob.nodes->factor(1e-4);
  EXPECT_EQ(blob.nodes->factor(1e-4), first);
  for (std::size_t k = 1; k <= NodalSpace::kKeptFactors; ++k)
    blob.nodes->factor(1e-4 + 1e-5 * static_cast<double>(k));
  EXPECT_NE(blob.nodes->factor(1e-4), first);
}

/// Bent by a tenth of its size, in its lowest modes, and spun: with all modes and with nodes.
Twins nonlinear_twins(double damping = 1.0) {
  const std::shared_ptr<const FullBlob> blob = nonlinear_blob();
  blob->archetype->alpha *= damping, blob->archetype->beta *= damping;
  Twins t = twins(*blob);
  VecX q = VecX::Zero(blob->archetype->r());
  q.head<4>() << 0.35, -0.2, 0.15, 0.1;
  t.with_modes.q = q;
  t.with_nodes.q = blob->archetype->node_modes * q;
  return t;
}

TEST(NonlinearFullBody, ForceAndTangentAreThoseOfAllModes) {
  const Twins t = nonlinear_twins();
  const ReducedBody &modes = t.with_modes, &nodes = t.with_nodes;
  const MatX& S = nodes.archetype->node_modes;
  EXPECT_NEAR(elastic_energy(modes), elastic_energy(nodes), 1e-12 * elastic_energy(modes));
  const VecX force = elastic_force(modes, modes.q);
  EXPECT_LT((force - S.transpose() * elastic_force(nodes, nodes.q)).norm(), 1e-12 * force.norm());
  EXPECT_GT((force - modes.archetype->K_r * modes.q).norm(), 0.1 * force.norm());

  const double dt = 0.01;
  const auto stage = [&](const ReducedBody& body) {
    return free_motion(body, current_configuration(body), VecX::Zero(body.dofs()), dt,
                       Stage::kPositionHalf, {});
  };
  const FreeMotion modal = stage(modes), nodal = stage(nodes);
  std::srand(4);
  const VecX f = VecX::Random(modes.r), answer = modal.H.modal_solve(f);
  // forces of the modes on the nodes: M S
  const VecX of_nodes = nodal.H.modal_solve(nodes.nodes->product(1.0, 0.0, S * f));
  EXPECT_LT((S * answer - of_nodes).norm(), 1e-9 * of_nodes.norm());
  const VecX back = nodal.H.modal_product(of_nodes);
  EXPECT_LT((S.transpose() * back - f).norm(), 1e-9 * f.norm());
  EXPECT_LT((S.transpose() * nodal.slope_product(S * f) - modal.slope_product(f)).norm(),
            1e-8 * modal.slope_product(f).norm());
}

// Measured: 6e-12 of the size apart.
TEST(NonlinearFullBody, MovesAsWithAllModesFor200Steps) {
  Twins t = nonlinear_twins();
  const Vec3 P = t.with_nodes.P, L = t.with_nodes.L;
  dry_steps(t.with_modes, 200, 0.01, {});
  dry_steps(t.with_nodes, 200, 0.01, {});
  const double apart = relative_distance(t.with_modes, t.with_nodes);
  std::printf("measured: %.1e\n", apart);
  EXPECT_LT(apart, 1e-8);
  EXPECT_EQ(t.with_nodes.P, P);
  EXPECT_EQ(t.with_nodes.L, L);
}

// Undamped, steps of a quarter over the lowest frequency: as a bar with nonlinear modes [D54].
TEST(NonlinearFullBody, KeepsItsEnergy) {
  ReducedBody body = nonlinear_twins(0.0).with_nodes;
  const auto energy = [&] { return kinetic_energy(body) + elastic_energy(body); };
  const double first = energy(), dt = 0.25 / std::sqrt(body.archetype->omega2[0]);
  double least = first, most = first;
  for (int step = 0; step < 300; ++step) {
    dry_steps(body, 1, dt, {});
    least = std::min(least, energy()), most = std::max(most, energy());
  }
  std::printf("measured: %.4f to %.4f of the first\n", least / first, most / first);
  EXPECT_LT(most, 1.01 * first);
  EXPECT_GT(least, 0.97 * first);
}

// A body crushed to a third of its height, in a long step: its stiffness is not definite, the mass that
// impulses meet is.
TEST(NonlinearFullBody, MassIsDefiniteWhereTheStiffnessIsNot) {
  const Twins t = nonlinear_twins();
  ReducedBody body = t.with_nodes;
  body.q_dot.setZero();
  for (int p = 0; p < body.r; p += 3) body.q[p + 2] = -0.67 * body.nodes->rest_of_mass()[p + 2];
  const FreeMotion motion = free_motion(body, current_configuration(body), VecX::Zero(body.dofs()),
                                        0.5, Stage::kVelocityFull, {});
  std::srand(6);
  double least = INFINITY;
  for (int trial = 0; trial < 50; ++trial) {
    const VecX f = VecX::Random(body.r), answer = motion.H.modal_solve(f);
    least = std::min(least, f.dot(answer));
  }
  EXPECT_GT(least, 0.0);
}

// Points of contacts and joints, two of one item: J, its transpose, and what they answer.
TEST(NodalRows, AreTheVelocitiesOfTheirPoints) {
  const FullBlob blob;
  const ReducedBody body = twins(blob).with_nodes;
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, terms, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  const Mat3 frame = Quat(0.3, 0.8, -0.1, 0.2).normalized().toRotationMatrix();
  NodalRows rows(body, terms);
  MatX J(9, body.dofs());
  const VertexShares moved[3] = {{{3, 1.0}}, {{1, 0.3}, {7, 0.9}, {12, -0.2}}, {}};
  const int item[3] = {2, 5, 5};
  for (int p = 0; p < 3; ++p) {
    const Vec3 arm(0.1, 0.05 * p, -0.2);
    rows.add(item[p], frame, arm, moved[p]);
    MatX phi = MatX::Zero(3, body.r);
    for (const VertexShare& m : moved[p]) phi += m.weight * modes_at_vertex(body, m.vertex);
    J.middleRows<3>(3 * p) = frame * arm_jacobian(body, terms, arm, phi);
  }
  NodalInverse inverse(H);
  std::srand(5);
  inverse.add(MatX::Random(body.dofs(), 2), MatX::Identity(2, 2));
  rows.set_inverse(inverse);
  const MatX y = MatX::Random(body.dofs(), 2), g = MatX::Random(9, 2);
  EXPECT_LT((rows.velocity(y) - J * y).norm(), 1e-13 * (J * y).norm());
  EXPECT_LT((rows.force(g) - J.transpose() * g).norm(), 1e-13 * (J.transpose() * g).norm());
  EXPECT_EQ(rows.rows_of(2), MatX(MatX::Identity(9, 9).topRows(3)));
  EXPECT_EQ(rows.rows_of(5), MatX(MatX::Identity(9, 9).bottomRows(6)));
  EXPECT_EQ(rows.rows_of(4).rows(), 0);
  const auto expect_answers = [&](const MatX& answers) {
    for (int k = 0; k < 9; ++k) {
      const VecX answer = answers.col(k);
      EXPECT_LT((rows.answers({k}).col(0) - answer).norm(), 1e-12 * answer.norm());
      EXPECT_LT((rows.inverse_mass().col(k) - J * answer).norm(), 1e-12 * (J * answer).norm());
    }
    EXPECT_LT((rows.answer(g) - answers * g).norm(), 1e-12 * (answers * g).norm());
    const MatX reduced = body.nodes->reduced_velocity(answers);
    EXPECT_LT((rows.reduced() - reduced).norm(), 1e-12 * reduced.norm());
  };
  expect_answers(inverse.solve(J.transpose()));
  rows.set_inverse(NodalInverse(H));
  MatX answers(body.dofs(), 9);
  for (int k = 0; k < 9; ++k) answers.col(k) = H.solve(J.row(k).transpose());
  expect_answers(answers);
}

}  // namespace
}  // namespace archetide
