#include "runtime/output/body_surface.h"

#include <gtest/gtest.h>

#include "common/tri_mesh.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

TEST(BodiesSurface, PlacesEveryBodyInTheWorldUnderItsNumber) {
  const auto archetype = tetrahedron_archetype();
  std::vector<ReducedBody> bodies = {rigid_body(archetype), rigid_body(archetype)};
  bodies[1].position = Vec3(5, 0, 0);
  bodies[1].rotation = Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()));
  const SurfaceMesh mesh = bodies_surface(bodies);

  ASSERT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.body, (std::vector<int>{0, 0, 0, 0, 1, 1, 1, 1}));
  // The second body's vertex (1, 0, 0) turns to (0, 1, 0) and moves by 5.
  EXPECT_LT((mesh.vertices[5] - Vec3(5, 1, 0)).norm(), 1e-14);
  // Two outward tetrahedra of volume 1/6 each.
  EXPECT_NEAR(enclosed_volume({mesh.vertices, mesh.triangles}), 1.0 / 3.0, 1e-14);
  for (const Vec3& n : mesh.normals) EXPECT_NEAR(n.norm(), 1.0, 1e-14);
}

TEST(BodiesSurface, NoBodiesGiveNoSurface) { EXPECT_TRUE(bodies_surface({}).vertices.empty()); }

}  // namespace
}  // namespace archetide
