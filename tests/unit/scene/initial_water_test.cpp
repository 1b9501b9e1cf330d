#include "runtime/scene/initial_water.h"

#include <gtest/gtest.h>

namespace archetide {
namespace {

FluidSpec tank() {
  FluidSpec fluid;
  fluid.cells = Vec3i(10, 8, 6);
  fluid.cell = 0.5;
  fluid.origin = Vec3(1, 2, 3);
  fluid.water.full = false;
  return fluid;
}

TEST(InitialWater, LevelIsMeasuredFromTheFloorOfTheTank) {
  FluidSpec fluid = tank();
  fluid.water.level = 1.3;
  const Array3<double> phi = initial_fluid(fluid).phi;
  // Centre of the second layer, 0.75 m above the floor: 0.55 m below the surface.
  EXPECT_NEAR(phi(4, 4, 1), 0.75 - 1.3, 1e-15);
  EXPECT_NEAR(phi(0, 0, 5), 2.75 - 1.3, 1e-15);
  EXPECT_NEAR(highest_water(fluid), 4.3, 1e-15);
}

TEST(InitialWater, FullAndDryTanksHaveNoSurface) {
  FluidSpec fluid = tank();
  fluid.water.full = true;
  EXPECT_TRUE(has_water(fluid.water));
  EXPECT_LT(initial_fluid(fluid).phi(9, 7, 5), -fluid.cell);
  fluid.water.full = false;
  fluid.water.level = 0.0;
  EXPECT_FALSE(has_water(fluid.water));
  EXPECT_GT(initial_fluid(fluid).phi(0, 0, 0), fluid.cell);
  EXPECT_EQ(initial_fluid(std::nullopt).phi.size(), 0u);
}

TEST(InitialWater, ShapesAreExactDistancesAndTheirUnion) {
  FluidSpec fluid = tank();
  fluid.water.boxes = {{{Vec3(1, 2, 3), Vec3(2, 3, 4)}}};
  fluid.water.spheres = {{{Vec3(5, 4, 5), 0.7}}};
  const Grid g = tank_grid(fluid);
  const Array3<double> phi = initial_fluid(fluid).phi;
  EXPECT_NEAR(phi(0, 0, 0), -0.25, 1e-15);  // a quarter metre inside the faces of the box
  // From (2.25, 3.25, 4.25) to the corner (2, 3, 4).
  EXPECT_NEAR(phi(2, 2, 2), std::sqrt(3.0) * 0.25, 1e-15);
  const Vec3 x = g.cell_centre(7, 3, 3);
  EXPECT_NEAR(phi(7, 3, 3), (x - Vec3(5, 4, 5)).norm() - 0.7, 1e-15);
  EXPECT_NEAR(highest_water(fluid), 5.7, 1e-15);
}

// A pool that streams, a box in it with a velocity of its own, a ball above that falls, a second box
// without one; faces in the air have that of the nearest water.
TEST(InitialWater, ShapesHaveVelocitiesOfTheirOwn) {
  FluidSpec fluid = tank();
  EXPECT_EQ(initial_fluid(fluid).u[0].size(), 0u);  // at rest
  fluid.velocity = Vec3(1, 0, 0);
  fluid.water.level = 1.0;
  fluid.water.boxes = {{{Vec3(1, 2, 3), Vec3(2, 3, 3.5)}, Vec3(0, 2, 0)},
                       {{Vec3(1, 5, 3), Vec3(2, 6, 4.5)}}};
  fluid.water.spheres = {{{Vec3(4, 4, 5.5), 0.4}, Vec3(0, 0, -3)}};
  const Grid g = tank_grid(fluid);
  const MacField u = initial_fluid(fluid).u;
  EXPECT_EQ(interpolate(g, u, Vec3(1.5, 2.5, 3.25)), Vec3(0, 2, 0));
  EXPECT_EQ(interpolate(g, u, Vec3(4.5, 4.5, 3.25)), Vec3(1, 0, 0));
  EXPECT_EQ(interpolate(g, u, Vec3(1.5, 5.5, 4.0)), Vec3(1, 0, 0));
  EXPECT_EQ(interpolate(g, u, Vec3(4.0, 4.0, 5.5)), Vec3(0, 0, -3));
  EXPECT_EQ(interpolate(g, u, Vec3(4.0, 4.0, 5.2)), Vec3(0, 0, -3));  // air under the ball
  fluid.water = WaterSpec();
  const MacField full = initial_fluid(fluid).u;
  EXPECT_EQ(interpolate(g, full, Vec3(3.3, 4.1, 5.2)), Vec3(1, 0, 0));
}

// A closed box as a mesh, outward.
TriMesh box_mesh(const Vec3& low, const Vec3& high) {
  TriMesh mesh;
  for (int n = 0; n < 8; ++n) {
    mesh.vertices.emplace_back(n & 1 ? high[0] : low[0], n & 2 ? high[1] : low[1],
                               n & 4 ? high[2] : low[2]);
  }
  const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& q : quads) {
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  }
  return mesh;
}

TEST(InitialWater, AMeshGivesTheSameDistanceAsTheSameBox) {
  const Grid g{20, 18, 16, 0.1, Vec3(0, 0, 0)};
  const Vec3 low(0.4, 0.4, 0.4), high(1.3, 1.2, 1.1);
  ASSERT_GT(enclosed_volume(box_mesh(low, high)), 0.0);
  Array3<double> phi(g.nx, g.ny, g.nz, 100.0);
  add_mesh(g, box_mesh(low, high), phi);
  FluidSpec fluid;
  fluid.cells = Vec3i(g.nx, g.ny, g.nz);
  fluid.cell = g.dx;
  fluid.water.full = false;
  fluid.water.boxes = {{{low, high}}};
  const Array3<double> box = initial_fluid(fluid).phi;
  for (std::size_t n = 0; n < phi.size(); ++n) {
    ASSERT_NEAR(phi[n], std::clamp(box[n], -0.3, 0.3), 1e-12) << n;  // exact within three cells
  }
}

TEST(TriangleDistance, IsExactOverFaceEdgeAndCorner) {
  const Vec3 a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  EXPECT_DOUBLE_EQ(distance_to_triangle(Vec3(0.5, 0.5, -3), a, b, c), 3.0);
  EXPECT_DOUBLE_EQ(distance_to_triangle(Vec3(1, -3, 4), a, b, c), 5.0);
  EXPECT_DOUBLE_EQ(distance_to_triangle(Vec3(-1, -2, 2), a, b, c), 3.0);
  EXPECT_DOUBLE_EQ(distance_to_triangle(Vec3(2, 2, 0), a, b, c), std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(distance_to_triangle(Vec3(1, 1, 0), a, a, b), 1.0);  // degenerate: a segment
}

}  // namespace
}  // namespace archetide
