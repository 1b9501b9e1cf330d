#include "precompute/modal/canonical_basis.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "precompute/modal/modes.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

const Material kRubber{.density = 1000.0, .young = 1e6, .poisson = 0.3};

/// A square bar whose mesh is its own mirror image under x <-> y: bending modes come in exact
/// pairs.
TetMesh symmetric_bar() {
  TetMesh mesh = shapes::tet_box(2, 2, 8, 0.25);
  move_to_centre_of_mass(mesh);
  return mesh;
}

ModesResult modes_of(const TetMesh& mesh, int count) {
  Profile profile;
  ModesOptions options;
  options.count = count;
  return compute_modes(mesh, kRubber, options, profile);
}

TEST(CanonicalBasis, UndoesAnyRotationInsideAPairOfEqualModes) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  const ModesResult modes = modes_of(mesh, 6);
  VecX omega2 = modes.omega2;
  omega2[1] = omega2[0];  // a pair by decree
  for (const double angle : {0.3, 1.5, 2.9, -2.0}) {
    MatX turned = modes.node_modes;
    turned.col(0) =
        std::cos(angle) * modes.node_modes.col(0) + std::sin(angle) * modes.node_modes.col(1);
    turned.col(1) =
        std::sin(angle) * modes.node_modes.col(0) - std::cos(angle) * modes.node_modes.col(1);
    turned.col(3) *= -1.0;
    MatX first = modes.node_modes;
    canonicalise(mesh.nodes, mass, omega2, first);
    canonicalise(mesh.nodes, mass, omega2, turned);
    EXPECT_LT((turned - first).cwiseAbs().maxCoeff(), 1e-10 * first.cwiseAbs().maxCoeff());
  }
}

TEST(CanonicalBasis, KeepsTheSpaceAndItsOrthonormality) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  const MatX before = modes_of(mesh, 6).node_modes;
  MatX after = before;
  canonicalise(mesh.nodes, mass, VecX::Ones(before.cols()), after);  // all equal: all are mixed
  const MatX Q = before.transpose() * apply_mass(mass, after);
  const MatX one = MatX::Identity(Q.rows(), Q.cols());
  EXPECT_LT((Q * Q.transpose() - one).norm(), 1e-12);
  EXPECT_GT((Q - one).norm(), 0.1);
}

TEST(CanonicalBasis, FirstModeOfAPairTakesAllOfTheFirstReferenceFieldThatThePairKnows) {
  const TetMesh mesh = symmetric_bar();
  const SparseMatrix mass = mass_matrix(mesh, kRubber, MassKind::kLumped);
  MatX pair = modes_of(mesh, 6).node_modes.leftCols(2);
  canonicalise(mesh.nodes, mass, VecX::Ones(2), pair);
  // Bending: cross sections tilt. The first field of this kind is x z e_z.
  VecX field = VecX::Zero(pair.rows());
  for (std::size_t v = 0; v < mesh.nodes.size(); ++v)
    field[3 * Eigen::Index(v) + 2] = mesh.nodes[v][0] * mesh.nodes[v][2];
  const VecX part = pair.transpose() * apply_mass(mass, field);
  EXPECT_GT(std::abs(part[0]), 0.1 * std::sqrt(field.dot(apply_mass(mass, field).col(0))));
  EXPECT_LT(std::abs(part[1]), 1e-12 * std::abs(part[0]));
}

}  // namespace
}  // namespace archetide
