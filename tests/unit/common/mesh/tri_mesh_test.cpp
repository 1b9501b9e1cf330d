#include "common/mesh/tri_mesh.h"

#include <gtest/gtest.h>

#include "common/mesh/tet_mesh.h"

namespace archetide {
namespace {

/// Box [0, a] x [0, b] x [0, c] shifted by `at`, outward.
TriMesh box(const Vec3& size, const Vec3& at) {
  TriMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back(at + size.cwiseProduct(Vec3(i & 1, i >> 1 & 1, i >> 2)));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(TriMesh, BoxHasTheVolumeCentroidAndSecondMomentOfTheClosedForm) {
  const Vec3 size(1, 2, 3), at(10, -20, 5);
  const TriMesh mesh = box(size, at);
  const Vec3 centre = at + size / 2;
  // ∫ x xᵀ = V (c cᵀ + diag(size²) / 12). Tolerance 1e-14 relative to the largest entry (measured
  // 2e-16).
  const Mat3 second =
      6.0 * (centre * centre.transpose() + Mat3(size.cwiseAbs2().asDiagonal()) / 12.0);
  EXPECT_NEAR(enclosed_volume(mesh), 6.0, 1e-13);
  EXPECT_LT((enclosed_centroid(mesh) - centre).norm(), 1e-13);
  EXPECT_LT((enclosed_second_moment(mesh) - second).norm(), 1e-14 * second.norm());
  EXPECT_NEAR(surface_area(mesh), 2 * (2 + 3 + 6), 1e-13);
}

TEST(TriMesh, VolumeKeepsItsDigitsFarFromTheOrigin) {
  // Rounding of the vertices themselves: 1e6 * 2^-53 = 1e-10 m on 1 m edges (measured 0, these are
  // exact).
  EXPECT_NEAR(enclosed_volume(box(Vec3(1, 1, 1), Vec3(1e6, 1e6, 1e6))), 1.0, 1e-9);
}

TEST(TriMesh, InwardSurfaceHasNegativeVolume) {
  TriMesh mesh = box(Vec3(1, 1, 1), Vec3::Zero());
  for (Vec3i& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_NEAR(enclosed_volume(mesh), -1.0, 1e-14);
}

TEST(TriMesh, VertexNormalsPointOutwardAndAreasAddUp) {
  const TriMesh mesh = box(Vec3(1, 2, 3), Vec3(4, 5, 6));
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(mesh, normals, areas);
  double sum = 0.0;
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_NEAR(normals[v].norm(), 1.0, 1e-14);
    EXPECT_GT(normals[v].dot(mesh.vertices[v] - Vec3(4.5, 6, 7.5)), 0.0);
    sum += areas[v];
  }
  EXPECT_NEAR(sum, surface_area(mesh), 1e-13);
}

/// A cube of six tets around the diagonal 0-7, with one extra node in the middle of nowhere.
TetMesh six_tet_cube() {
  TetMesh mesh;
  mesh.nodes.emplace_back(9, 9, 9);
  for (int i = 0; i < 8; ++i) mesh.nodes.emplace_back(i & 1, i >> 1 & 1, i >> 2);
  mesh.tets = {{1, 2, 4, 8}, {1, 4, 3, 8}, {1, 3, 7, 8}, {1, 7, 5, 8}, {1, 5, 6, 8}, {1, 6, 2, 8}};
  return mesh;
}

TEST(TetMesh, BoundarySurfaceEnclosesTheTets) {
  const TetMesh mesh = six_tet_cube();
  std::vector<int> surface_to_node;
  const TriMesh surface = boundary_surface(mesh, surface_to_node);
  double volume = 0.0;
  for (int t = 0; t < 6; ++t) {
    EXPECT_NEAR(tet_volume(mesh, t), 1.0 / 6.0, 1e-15);
    volume += tet_volume(mesh, t);
  }
  EXPECT_NEAR(enclosed_volume(surface), volume, 1e-14);
  EXPECT_NEAR(surface_area(surface), 6.0, 1e-14);
  EXPECT_EQ(surface.triangles.size(), 12u);
  EXPECT_EQ(surface_to_node, (std::vector<int>{1, 2, 3, 4, 5, 6, 7, 8}));
  for (std::size_t v = 0; v < 8; ++v)
    EXPECT_EQ(surface.vertices[v], mesh.nodes[surface_to_node[v]]);
}

}  // namespace
}  // namespace archetide
