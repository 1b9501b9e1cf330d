#include "precompute/base/tet_element.h"

#include <gtest/gtest.h>

#include "precompute/meshing/quadratic_tets.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

double factorial(int n) { return n < 2 ? 1.0 : n * factorial(n - 1); }

/// Integral of L1^i L2^j L3^k over the reference tet: i! j! k! / (i + j + k + 3)!
double monomial_integral(int i, int j, int k) {
  return factorial(i) * factorial(j) * factorial(k) / factorial(i + j + k + 3);
}

/// Largest relative error over all monomials up to `degree`.
double worst_error(const TetRule& rule, int degree) {
  double worst = 0.0;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j)
      for (int k = 0; i + j + k <= degree; ++k) {
        double sum = 0.0;
        for (std::size_t p = 0; p < rule.points.size(); ++p)
          sum += rule.weights[p] * std::pow(rule.points[p][0], i) * std::pow(rule.points[p][1], j) *
                 std::pow(rule.points[p][2], k);
        worst = std::max(worst, std::abs(sum / monomial_integral(i, j, k) - 1.0));
      }
  return worst;
}

TEST(TetRule, IsExactUpToItsDegreeAndNotBeyond) {
  EXPECT_LT(worst_error(four_point_rule(), 2), 1e-13);
  EXPECT_GT(worst_error(four_point_rule(), 3), 1e-3);
  for (int m = 1; m <= 4; ++m) {
    EXPECT_LT(worst_error(conical_rule(m), 2 * m - 1), 1e-13) << m;  // measured 2e-15
    EXPECT_GT(worst_error(conical_rule(m), 2 * m), 1e-4) << m;
  }
}

TEST(TetShape, ReproducesQuadraticFieldsAndTheirGradients) {
  const auto x = reference_positions<10>();
  const auto field = [](const Vec3& p) {
    return 1.0 + 2.0 * p[0] - p[1] + 3.0 * p[0] * p[1] - 0.5 * p[2] * p[2] + p[1] * p[2];
  };
  TetShape<10>::Values nodal;
  for (int i = 0; i < 10; ++i) nodal[i] = field(x.col(i));
  const Vec3 p(0.2, 0.15, 0.4);
  EXPECT_NEAR(TetShape<10>::values(p).dot(nodal), field(p), 1e-14);
  const Vec3 gradient(2.0 + 3.0 * p[1], -1.0 + 3.0 * p[0] + p[2], -p[2] + p[1]);
  EXPECT_LT((TetShape<10>::gradients(p) * nodal - gradient).norm(), 1e-14);
}

TEST(TetMoments, OfACurvedTetFollowFromTheDivergenceTheorem) {
  // One face bulges: its middle nodes move along +z, all else stays.
  TetMesh mesh =
      with_middle_nodes(TetMesh{{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}}, {{0, 1, 2, 3}}, {}});
  ASSERT_GT(tet_volume(mesh, 0), 0.0);
  const double straight = tet_moments(mesh, 0).volume;
  EXPECT_NEAR(straight, 1.0 / 6.0, 1e-15);
  for (int e = 0; e < 3; ++e) mesh.nodes[mesh.mids[0][e]][2] += 0.1;  // edges of the face z = 0
  // The face bulges by 0.4 (L0 L1 + L1 L2 + L0 L2), which adds 0.4 * 3 / 12 of its area 1/2; the
  // edge 1-2 takes the slanted face along, whose vector area has the z component -1/2: minus 0.4 /
  // 12 / 2.
  EXPECT_NEAR(tet_moments(mesh, 0).volume - straight, 0.05 - 1.0 / 60.0, 1e-15);
}

TEST(TetMoments, FollowATranslation) {
  TetMesh mesh =
      with_middle_nodes(TetMesh{{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, -1}}, {{0, 1, 2, 3}}});
  mesh.nodes[6] += Vec3(0.05, -0.1, 0.1);
  const TetMoments before = tet_moments(mesh, 0);
  const Vec3 move(1, -2, 3);
  for (Vec3& x : mesh.nodes) x += move;
  const TetMoments after = tet_moments(mesh, 0);
  EXPECT_NEAR(after.volume, before.volume, 1e-14);
  EXPECT_LT((after.first - before.first - before.volume * move).norm(), 1e-14);
}

TEST(SmallestJacobian, IsOneForStraightTetsAndNegativeForFoldedOnes) {
  Eigen::Matrix<double, 3, 10> x = reference_positions<10>();
  EXPECT_TRUE(is_straight(x));
  EXPECT_NEAR(smallest_jacobian(x), 1.0, 1e-14);
  x(0, 4) += 0.4;  // the middle of 0-1 almost at the corner 1: dx/dL vanishes at 3/4
  EXPECT_FALSE(is_straight(x));
  EXPECT_LT(smallest_jacobian(x), 0.0);
}

TEST(BoundarySurface, OfQuadraticTetsHasFourTrianglesAFace) {
  const TetMesh linear = shapes::tet_box(2, 2, 2, 0.5);
  const TetMesh quadratic = with_middle_nodes(linear);
  std::vector<int> node;
  const TriMesh coarse = boundary_surface(linear, node);
  const TriMesh fine = boundary_surface(quadratic, node);
  EXPECT_EQ(fine.triangles.size(), 4 * coarse.triangles.size());
  EXPECT_NEAR(enclosed_volume(fine), 1.0, 1e-14);
  for (std::size_t v = 0; v < node.size(); ++v)
    EXPECT_EQ(fine.vertices[v], quadratic.nodes[node[v]]);
}

}  // namespace
}  // namespace archetide
