#include "common/archetype/tet_elasticity.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "precompute/modal/keep_matrices.h"
#include "precompute/modal/nonlinear_elasticity.h"
#include "tests/nonlinear/box_mesh.h"

namespace archetide {
namespace {

TetMesh linear_box() {
  TetMesh mesh = box_mesh(Vec3(1.0, 0.6, 0.5), Vec3i(2, 2, 1));
  mesh.mids.clear();
  int corners = 0;
  for (const auto& tet : mesh.tets)
    for (const int node : tet) corners = std::max(corners, node + 1);
  mesh.nodes.resize(static_cast<std::size_t>(corners));
  return mesh;
}

MatX dense(const TetMatrices& m, const std::vector<Mat3>& blocks) {
  const auto n = static_cast<long>(m.row_ends.size());
  MatX K = MatX::Zero(3 * n, 3 * n);
  for (int p = 0; p < n; ++p)
    for (int e = m.row_begin(p); e < m.row_end(p); ++e) {
      K.block<3, 3>(3L * p, 3L * m.column[e]) = blocks[e];
      K.block<3, 3>(3L * m.column[e], 3L * p) = blocks[e].transpose();
    }
  return K;
}

// Displacements by some tenths of a tet; differences of second order with steps of 1e-5.
TEST(TetElasticity, ForceAndStiffnessAreDerivativesOfTheEnergy) {
  const Material material{1.0, 3.0, 0.35};
  for (const TetMesh& mesh : {linear_box(), box_mesh(Vec3(1.0, 0.6, 0.5), Vec3i(1, 1, 1))}) {
    const TetMatrices matrices = keep_matrices(mesh, material, MassKind::kConsistent, true);
    const TetElasticity V(mesh, matrices.lambda, matrices.mu);
    const std::vector<int> places = V.places_in(matrices);
    std::srand(1);
    const VecX u = 0.06 * VecX::Random(V.size());
    const VecX f = V.force(u);
    VecX differences(V.size());
    MatX K(V.size(), V.size());
    constexpr double kStep = 1e-5;
    for (int i = 0; i < V.size(); ++i) {
      const VecX step = kStep * VecX::Unit(V.size(), i);
      differences[i] = (V.energy(u + step) - V.energy(u - step)) / (2 * kStep);
      K.col(i) = (V.force(u + step) - V.force(u - step)) / (2 * kStep);
    }
    std::vector<Mat3> blocks(matrices.column.size(), Mat3::Zero());
    V.add_stiffness(u, 2.0, places, blocks);
    const MatX assembled = 0.5 * dense(matrices, blocks);
    std::printf("measured: %.1e, %.1e\n", (f - differences).norm() / f.norm(),
                (K - assembled).norm() / K.norm());
    EXPECT_LT((f - differences).norm(), 1e-7 * f.norm());
    EXPECT_LT((K - assembled).norm(), 1e-7 * K.norm());

    // at rest it is the stiffness of linear elasticity
    blocks.assign(blocks.size(), Mat3::Zero());
    V.add_stiffness(VecX::Zero(V.size()), 1.0, places, blocks);
    const MatX rest = dense(matrices, matrices.stiffness);
    EXPECT_LT((dense(matrices, blocks) - rest).norm(), 1e-12 * rest.norm());
  }
}

}  // namespace
}  // namespace archetide
