// Every degree of freedom of a small mesh as modes.
#include "precompute/modal/complete_modes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "common/archetype/complete_basis.h"
#include "common/base/input_error.h"
#include "precompute/meshing/quadratic_tets.h"
#include "precompute/modal/modes.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

TetMesh bar(int order) {
  TetMesh mesh = shapes::tet_box(3, 2, 2, 0.1);
  if (order == 2) mesh = with_middle_nodes(mesh);
  move_to_centre_of_mass(mesh);
  return mesh;
}

ModesResult every_mode_of(const TetMesh& mesh) {
  Profile profile;
  ModesOptions options;
  options.every_motion = true;
  return compute_modes(mesh, kRubber, options, profile);
}

class CompleteModes : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(BothOrders, CompleteModes, testing::Values(1, 2));

// M = (M R)(M R)^T + (M Phi)(M Phi)^T and K = M Phi diag(omega^2) Phi^T M: nothing is missing.
TEST_P(CompleteModes, SpanEveryMotionOfTheTets) {
  const TetMesh mesh = bar(GetParam());
  const ModesResult modes = every_mode_of(mesh);
  const int n = static_cast<int>(mesh.nodes.size());
  ASSERT_EQ(modes.omega2.size(), elastic_dofs(n));
  const SparseMatrix mass = mass_matrix(mesh, kRubber, modes.mass);
  const MatX K = MatX(stiffness_matrix(mesh, kRubber)),
             weighted = apply_mass(mass, modes.node_modes);
  const MatX again = weighted * modes.omega2.asDiagonal() * weighted.transpose();
  EXPECT_LT((again - K).norm(), 1e-11 * K.norm());  // measured 1e-14 and 4e-14
  const MatX M = apply_mass(mass, MatX::Identity(3 * n, 3 * n));
  const MatX rigid = M - weighted * weighted.transpose();
  EXPECT_EQ(Eigen::FullPivLU<MatX>(rigid).setThreshold(1e-9).rank(), 6);
  EXPECT_LT(modes.residuals.maxCoeff(), 1e-9);  // measured 4e-14 and 6e-13
  EXPECT_LT(modes.rigid_content, 1e-12);
  EXPECT_LT(modes.orthonormality, 1e-11);
}

// The sparse solver finds the same lowest ones.
TEST_P(CompleteModes, BeginWithTheModesOfTheSparseSolver) {
  const TetMesh mesh = bar(GetParam());
  const ModesResult all = every_mode_of(mesh);
  Profile profile;
  ModesOptions options;
  options.count = 12;
  const ModesResult few = compute_modes(mesh, kRubber, options, profile);
  const auto r = few.omega2.size();
  EXPECT_LT((all.omega2.head(r).array() / few.omega2.array() - 1.0).abs().maxCoeff(), 1e-9);
  // each of them lies in the span of those with its frequency
  const MatX overlap = few.node_modes.transpose() *
                       apply_mass(mass_matrix(mesh, kRubber, all.mass), all.node_modes.leftCols(r));
  EXPECT_LT((overlap * overlap.transpose() - MatX::Identity(r, r)).norm(), 1e-8);
}

TEST(CompleteModesLimit, TooManyAreRefusedWithTheNumbers) {
  const TetMesh mesh = shapes::tet_box(10, 7, 7, 0.1);  // 704 nodes
  try {
    every_mode_of([&] {
      TetMesh centred = mesh;
      move_to_centre_of_mass(centred);
      return centred;
    }());
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("2106 modes of 704 nodes"), std::string::npos) << text;
    EXPECT_NE(text.find("at most 1500 modes, 502 nodes"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace archetide
