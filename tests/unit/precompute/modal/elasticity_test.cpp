#include "precompute/modal/elasticity.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "common/base/input_error.h"
#include "precompute/modal/keep_matrices.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

const Material kSteelLike{.density = 7800.0, .young = 2e11, .poisson = 0.3};

/// A box whose inner nodes are moved by up to a fifth of the spacing, so that nothing cancels by
/// symmetry.
TetMesh distorted_box() {
  TetMesh mesh = shapes::tet_box(3, 4, 2, 0.1);
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      mesh.nodes[i][axis] += 0.02 * std::sin(7.0 * double(i) + 3.0 * axis);
  return mesh;
}

double volume_of(const TetMesh& mesh) {
  double volume = 0.0;
  for (int t = 0; t < int(mesh.tets.size()); ++t) volume += tet_volume(mesh, t);
  return volume;
}

/// The displacement u(x) = G x + c at the nodes, 3n.
VecX linear_field(const TetMesh& mesh, const Mat3& G, const Vec3& c) {
  VecX u(3 * Eigen::Index(mesh.nodes.size()));
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    u.segment<3>(3 * Eigen::Index(i)) = G * mesh.nodes[i] + c;
  return u;
}

TEST(KeptMatrices, AreTheLowerTriangleOfMassAndStiffness) {
  const TetMesh mesh = distorted_box();
  for (const MassKind kind : {MassKind::kConsistent, MassKind::kLumped}) {
    const TetMatrices kept = keep_matrices(mesh, kSteelLike, kind);
    const MatX K = stiffness_matrix(mesh, kSteelLike), M = mass_matrix(mesh, kSteelLike, kind);
    MatX K_kept = MatX::Zero(K.rows(), K.cols()), M_kept = MatX::Zero(M.rows(), M.cols());
    for (int p = 0; p < static_cast<int>(kept.row_ends.size()); ++p)
      for (int e = kept.row_begin(p); e < kept.row_end(p); ++e) {
        const int q = kept.column[e];
        K_kept.block<3, 3>(3L * p, 3L * q) = kept.stiffness[e];
        K_kept.block<3, 3>(3L * q, 3L * p) = kept.stiffness[e].transpose();
        M_kept(p, q) = M_kept(q, p) = kept.mass[e];
      }
    EXPECT_EQ(M_kept, M);
    EXPECT_LT((K_kept - K).norm(), 1e-14 * K.norm());  // K is symmetric to round-off
  }
}

TEST(Elasticity, RigidMotionsCauseNoForce) {
  const TetMesh mesh = distorted_box();
  const SparseMatrix K = stiffness_matrix(mesh, kSteelLike);
  Mat3 spin;
  spin << 0, -0.3, 0.7, 0.3, 0, -0.2, -0.7, 0.2, 0;
  const VecX u = linear_field(mesh, spin, {0.5, -1.0, 2.0});
  // Round-off of |K| |u|: 1e-12 relative asked for, 1.4e-17 measured.
  EXPECT_LT((K * u).norm(), 1e-12 * K.norm() * u.norm());
}

TEST(Elasticity, ConstantStrainHasTheExactEnergy) {
  const TetMesh mesh = distorted_box();
  const SparseMatrix K = stiffness_matrix(mesh, kSteelLike);
  Mat3 G;
  G << 1e-3, 4e-4, -2e-4, 1e-4, -5e-4, 3e-4, 2e-4, -1e-4, 7e-4;
  const Mat3 strain = 0.5 * (G + G.transpose());
  const double mu = kSteelLike.young / 2.6;
  const double lambda = kSteelLike.young * 0.3 / (1.3 * 0.4);
  // W = V (lambda/2 tr^2 + mu strain : strain), reproduced exactly by linear tets (patch test).
  const double exact = volume_of(mesh) *
                       (0.5 * lambda * strain.trace() * strain.trace() + mu * strain.squaredNorm());
  const VecX u = linear_field(mesh, G, {1e-4, 2e-4, -1e-4});
  EXPECT_NEAR(0.5 * u.dot(K * u), exact, 1e-10 * exact);
}

TEST(Elasticity, UniformStressBalancesAtInnerNodes) {
  const TetMesh mesh = distorted_box();
  const VecX f = stiffness_matrix(mesh, kSteelLike) *
                 linear_field(mesh, 1e-3 * Vec3(1, -2, 0.5).asDiagonal(), Vec3::Zero());
  int inner = 0;
  for (int k = 1; k < 2; ++k)
    for (int j = 1; j < 4; ++j)
      for (int i = 1; i < 3; ++i, ++inner) {
        const int node = (k * 5 + j) * 4 + i;
        EXPECT_LT(f.segment<3>(3 * node).norm(), 1e-11 * f.norm());
      }
  EXPECT_EQ(inner, 6);
}

TEST(Elasticity, StiffnessIsSymmetricWithExactlySixZeroEigenvalues) {
  const SparseMatrix K = stiffness_matrix(shapes::tet_box(2, 2, 1, 0.5), kSteelLike);
  const MatX dense(K);
  EXPECT_LT((dense - dense.transpose()).norm(), 1e-14 * dense.norm());
  const VecX values = Eigen::SelfAdjointEigenSolver<MatX>(dense).eigenvalues();
  const double largest = values[values.size() - 1];
  EXPECT_LT(values.head(6).cwiseAbs().maxCoeff(), 1e-13 * largest);
  EXPECT_GT(values[6], 1e-4 * largest);
}

TEST(Elasticity, MassIsSymmetricPositiveAndSumsToDensityTimesVolume) {
  const TetMesh mesh = distorted_box();
  for (MassKind kind : {MassKind::kConsistent, MassKind::kLumped}) {
    const MatX M(mass_matrix(mesh, Material{7800.0, 1.0, 0.0}, kind));
    EXPECT_EQ((M - M.transpose()).norm(), 0.0);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatX>(M).eigenvalues()[0], 0.0);
    EXPECT_NEAR(M.sum(), 7800.0 * volume_of(mesh), 1e-12 * M.sum());
  }
}

TEST(Elasticity, ConsistentMassIntegratesProductsOfLinearFieldsExactly) {
  const TetMesh mesh = shapes::tet_box(4, 2, 3, 0.25);  // [0, 1] x [0, 0.5] x [0, 0.75]
  const SparseMatrix M = mass_matrix(mesh, Material{1.0, 1.0, 0.0}, MassKind::kConsistent);
  VecX x(M.rows()), y(M.rows());
  for (int i = 0; i < int(M.rows()); ++i) x[i] = mesh.nodes[i][0], y[i] = mesh.nodes[i][1];
  EXPECT_NEAR(x.dot(M * x), 0.5 * 0.75 / 3.0, 1e-14);    // integral of x^2
  EXPECT_NEAR(x.dot(M * y), 0.5 * 0.125 * 0.75, 1e-14);  // integral of x y
}

TEST(Elasticity, ScalarMassActsOnEachAxisAlike) {
  const TetMesh mesh = distorted_box();
  const SparseMatrix M = mass_matrix(mesh, Material{3.0, 1.0, 0.0}, MassKind::kConsistent);
  const MatX x = MatX::Random(3 * M.rows(), 2);
  const MatX y = apply_mass(M, x);
  for (int axis = 0; axis < 3; ++axis) {
    const VecX part = x.col(1)(Eigen::seqN(axis, M.rows(), 3));
    const VecX got = y.col(1)(Eigen::seqN(axis, M.rows(), 3));
    EXPECT_LT((got - M * part).norm(), 1e-14 * got.norm());
  }
}

TEST(Elasticity, CentreOfMassMovesToTheOrigin) {
  TetMesh mesh = shapes::tet_box(2, 4, 6, 0.5);
  for (Vec3& x : mesh.nodes) x += Vec3(1e4, -2e3, 7.0);
  const Vec3 centre = move_to_centre_of_mass(mesh);
  EXPECT_LT((centre - Vec3(1e4 + 0.5, -2e3 + 1.0, 8.5)).norm(), 1e-10);
  const SparseMatrix M = mass_matrix(mesh, Material{1.0, 1.0, 0.0}, MassKind::kConsistent);
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    moment += M.col(Eigen::Index(i)).sum() * mesh.nodes[i];
  EXPECT_LT(moment.norm(), 1e-11 * M.sum());  // nodes at 1e4 m carry 2e-12 m of round-off
}

TEST(Elasticity, UnphysicalMaterialIsRefused) {
  const TetMesh mesh = shapes::tet_box(1, 1, 1, 1.0);
  EXPECT_THROW(stiffness_matrix(mesh, Material{1000.0, 1e5, 0.5}), InputError);
  EXPECT_THROW(stiffness_matrix(mesh, Material{1000.0, -1e5, 0.3}), InputError);
  EXPECT_THROW(stiffness_matrix(mesh, Material{0.0, 1e5, 0.3}), InputError);
}

}  // namespace
}  // namespace archetide
