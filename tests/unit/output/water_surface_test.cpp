#include "runtime/output/water_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "common/mesh/tri_mesh.h"

namespace archetide {
namespace {

Grid box(int nx, int ny, int nz, double dx) {
  Grid g;
  g.nx = nx, g.ny = ny, g.nz = nz, g.dx = dx;
  g.origin = Vec3(-0.3, 0.2, 1.1);
  return g;
}

template <class Function>
Array3<double> sampled(const Grid& g, Function f) {
  Array3<double> phi(g.nx, g.ny, g.nz);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) phi(i, j, k) = f(g.cell_centre(i, j, k));
  return phi;
}

double volume(const SurfaceMesh& mesh) { return enclosed_volume({mesh.vertices, mesh.triangles}); }

// Directed edges that are not matched by exactly one opposite edge.
int unmatched_edges(const SurfaceMesh& mesh) {
  std::map<std::pair<int, int>, int> count;
  for (const Vec3i& t : mesh.triangles)
    for (int e = 0; e < 3; ++e) ++count[{t[e], t[(e + 1) % 3]}];
  int bad = 0;
  for (const auto& [edge, n] : count) {
    const auto opposite = count.find({edge.second, edge.first});
    bad += n != 1 || opposite == count.end();
  }
  return bad;
}

double sphere_error(int n, SurfaceMesh* mesh_out = nullptr) {
  const double radius = 0.35;
  const Grid g = box(n, n, n, 1.0 / n);
  const Vec3 centre = g.origin + Vec3(0.51, 0.48, 0.5);
  const SurfaceMesh mesh =
      water_surface(g, sampled(g, [&](const Vec3& x) { return (x - centre).norm() - radius; }));
  if (mesh_out) *mesh_out = mesh;
  return volume(mesh) / (4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3)) - 1.0;
}

TEST(WaterSurface, SphereIsAClosedManifoldWithSecondOrderVolume) {
  SurfaceMesh mesh;
  const double coarse = sphere_error(24, &mesh), fine = sphere_error(48);
  EXPECT_EQ(unmatched_edges(mesh), 0);
  const int euler = static_cast<int>(mesh.vertices.size()) -
                    static_cast<int>(mesh.triangles.size()) * 3 / 2 +
                    static_cast<int>(mesh.triangles.size());
  EXPECT_EQ(euler, 2);
  EXPECT_LT(std::abs(coarse), 0.01);                             // measured 0.0085
  EXPECT_GT(std::log2(std::abs(coarse) / std::abs(fine)), 1.8);  // measured 2.00
}

TEST(WaterSurface, SphereNormalsPointAlongTheRadius) {
  SurfaceMesh mesh;
  sphere_error(32, &mesh);
  const Vec3 centre = box(32, 32, 32, 1.0 / 32).origin + Vec3(0.51, 0.48, 0.5);
  double worst = 1.0;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    worst = std::min(worst, mesh.normals[v].dot((mesh.vertices[v] - centre).normalized()));
  EXPECT_GT(worst, 0.999);  // measured 0.99999
}

TEST(WaterSurface, FlatLevelEnclosesItsExactVolume) {
  const Grid g = box(7, 5, 9, 0.1);
  for (double level : {0.05, 0.123, 0.45, 0.8999}) {
    const double z = g.origin[2] + level;
    const SurfaceMesh mesh = water_surface(g, sampled(g, [&](const Vec3& x) { return x[2] - z; }));
    EXPECT_EQ(unmatched_edges(mesh), 0);
    EXPECT_NEAR(volume(mesh), 0.7 * 0.5 * level, 1e-12);
    for (const Vec3& x : mesh.vertices) EXPECT_LE(x[2], z + 1e-12);
  }
}

TEST(WaterSurface, FullTankIsTheTank) {
  const Grid g = box(4, 6, 5, 0.2);
  const SurfaceMesh mesh = water_surface(g, sampled(g, [](const Vec3&) { return -1.0; }));
  EXPECT_EQ(unmatched_edges(mesh), 0);
  EXPECT_NEAR(volume(mesh), 0.8 * 1.2 * 1.0, 1e-12);
  EXPECT_NEAR(surface_area({mesh.vertices, mesh.triangles}), 2 * (0.96 + 0.8 + 1.2), 1e-12);
}

TEST(WaterSurface, EmptyTankHasNoSurface) {
  const Grid g = box(4, 4, 4, 0.2);
  EXPECT_TRUE(water_surface(g, sampled(g, [](const Vec3&) { return 1.0; })).triangles.empty());
}

TEST(WaterSurface, NoiseThatTouchesAllWallsIsStillAClosedManifold) {
  const Grid g = box(12, 11, 10, 0.1);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  const SurfaceMesh mesh = water_surface(g, sampled(g, [&](const Vec3&) { return value(random); }));
  EXPECT_GT(mesh.triangles.size(), 1000u);
  EXPECT_EQ(unmatched_edges(mesh), 0);
  EXPECT_GT(volume(mesh), 0.0);
}

TEST(WaterSurface, VerticesStayInsideTheTank) {
  const Grid g = box(12, 11, 10, 0.1);
  const SurfaceMesh mesh = water_surface(
      g, sampled(g, [&](const Vec3& x) { return std::sin(9 * x[0] + 5 * x[1]) * x[2]; }));
  for (const Vec3& x : mesh.vertices) {
    EXPECT_TRUE((x.array() >= g.low().array()).all());
    EXPECT_TRUE((x.array() <= g.high().array()).all());
  }
}

}  // namespace
}  // namespace archetide
