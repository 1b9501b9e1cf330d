#include "runtime/output/body_surface.h"

#include <gtest/gtest.h>

#include "common/mesh/tri_mesh.h"
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
  ASSERT_EQ(mesh.rest.size(), 8u);
  for (int v = 0; v < 8; ++v) EXPECT_EQ(mesh.rest[v], archetype->surface.vertices[v % 4]);
}

TEST(BodiesSurface, ASkinStandsInForItsBodies) {
  const auto archetype = tetrahedron_archetype();
  archetype->surface_modes.resize(12, 0);
  std::vector<ReducedBody> bodies(3, rigid_body(archetype));
  bodies[0].position = Vec3(0, 0, 9);
  bodies[1].position = Vec3(1, 0, 0);
  bodies[2].position = Vec3(3, 0, 0);
  // a skin like one of the bodies, a quarter of it moved by body 1
  auto skin = std::make_shared<Skin>();
  skin->surface = archetype->surface;
  skin->parts = {"first", "second"};
  for (std::size_t v = 0; v < skin->surface.vertices.size(); ++v) {
    skin->part_of.push_back({0, 1, 0, 0});
    skin->weights.insert(skin->weights.end(), {0.25, 0.75, 0.0, 0.0});
  }
  const SurfaceMesh mesh =
      bodies_surface(bodies, {{bind_skin(skin, {archetype, archetype}), {1, 2}}});
  ASSERT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.body, (std::vector<int>{0, 0, 0, 0, 1, 1, 1, 1}));
  for (int v = 0; v < 4; ++v) EXPECT_EQ(mesh.rest[4 + v], skin->surface.vertices[v]);
  for (int v = 0; v < 4; ++v)
    EXPECT_LT((mesh.vertices[4 + v] - archetype->surface.vertices[v] - Vec3(2.5, 0, 0)).norm(),
              1e-14);
}

TEST(BodiesSurface, NoBodiesGiveNoSurface) { EXPECT_TRUE(bodies_surface({}).vertices.empty()); }

}  // namespace
}  // namespace archetide
