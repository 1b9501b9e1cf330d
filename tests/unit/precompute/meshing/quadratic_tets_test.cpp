#include "precompute/meshing/quadratic_tets.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_sdf.h"
#include "precompute/base/tet_element.h"
#include "precompute/meshing/tetrahedralize.h"
#include "precompute/modal/elasticity.h"
#include "tests/support/random_vectors.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

constexpr double kPi = std::numbers::pi;
const Material kRubber{.density = 1000.0, .young = 1e6, .poisson = 0.3};

TetMesh curved(const TriMesh& surface, int target, CurveReport* report = nullptr) {
  TetrahedralizeOptions options;
  options.target = target;
  options.order = 2;
  TetrahedralizeResult result = tetrahedralize(surface, options);
  if (report) *report = result.curved;
  return result.mesh;
}

/// Upright cylinder of radius 1 and height 2, `n` sides.
TriMesh cylinder(int n) {
  TriMesh mesh;
  mesh.vertices = {{0, 0, -1}, {0, 0, 1}};
  for (int i = 0; i < n; ++i)
    for (double z : {-1.0, 1.0})
      mesh.vertices.emplace_back(std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n), z);
  for (int i = 0; i < n; ++i) {
    const int a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % n);
    mesh.triangles.emplace_back(0, b, a);
    mesh.triangles.emplace_back(1, a + 1, b + 1);
    mesh.triangles.emplace_back(a, b, b + 1);
    mesh.triangles.emplace_back(a, b + 1, a + 1);
  }
  return mesh;
}

TEST(ClosestPoint, AgreesWithTheSearchOverAllTriangles) {
  const TriMesh surface = shapes::torus(0.25, 0.1, 40, 20);
  const ClosestPoint tree(surface);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  for (int i = 0; i < 200; ++i) {
    const Vec3 x = random_vec3(uniform, random);
    double nearest = 1e9;
    for (const Vec3i& t : surface.triangles)
      nearest = std::min(
          nearest, (closest_point_on_triangle(x, surface.vertices[t[0]], surface.vertices[t[1]],
                                              surface.vertices[t[2]]) -
                    x)
                       .norm());
    EXPECT_EQ(tree.find(x, 1e9).distance, nearest);
    EXPECT_EQ(tree.find(x, 0.9 * nearest).triangle, -1);
  }
}

TEST(QuadraticTets, ShareTheirMiddleNodes) {
  const TetMesh mesh = with_middle_nodes(shapes::tet_box(3, 2, 1, 1.0));
  // Kuhn's cubes: axis edges, a diagonal for every square and one for every cube.
  const int edges = (3 * 3 * 2 + 4 * 2 * 2 + 4 * 3 * 1) + (3 * 2 * 2 + 4 * 2 * 1 + 3 * 3 * 1) + 6;
  EXPECT_EQ(mesh.nodes.size(), std::size_t(4 * 3 * 2 + edges));
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (int e = 0; e < 6; ++e)
      EXPECT_EQ(mesh.nodes[mesh.mids[t][e]], 0.5 * (mesh.nodes[mesh.tets[t][kTetEdges[e][0]]] +
                                                    mesh.nodes[mesh.tets[t][kTetEdges[e][1]]]));
}

TEST(QuadraticTets, BallsBoundaryLiesOnTheSphere) {
  CurveReport report;
  const TetMesh mesh = curved(shapes::sphere(1.0, 5), 600, &report);
  EXPECT_GT(report.moved, 300);
  EXPECT_EQ(report.held_back, 0);
  EXPECT_GT(report.smallest_jacobian, 0.5);  // measured 0.93
  std::vector<int> node;
  // Facets of the input are 3e-4 inside the sphere, and the volume's restoring moves less than
  // that.
  for (const Vec3& x : boundary_surface(mesh, node).vertices) EXPECT_NEAR(x.norm(), 1.0, 6e-4);
  EXPECT_NEAR(mesh_volume(mesh), enclosed_volume(shapes::sphere(1.0, 5)), 1e-7);
}

TEST(QuadraticTets, BoxStaysStraight) {
  CurveReport report;
  const TetMesh mesh = curved(shapes::box(Vec3(2, 1, 1), 4), 300, &report);
  EXPECT_EQ(report.moved, 0);
  EXPECT_NEAR(mesh_volume(mesh), 2.0, 1e-12);
}

TEST(QuadraticTets, RimOfACylinderStaysOnTheRim) {
  CurveReport report;
  const TetMesh mesh = curved(cylinder(120), 1500, &report);
  std::vector<int> node;
  int on_rim = 0;
  for (const Vec3& x : boundary_surface(mesh, node).vertices) {
    const double radius = std::hypot(x[0], x[1]);
    // 120 sides: the facets are up to 1 - cos(pi / 120) = 3.4e-4 inside.
    EXPECT_LT(radius, 1.0 + 6e-4);
    EXPECT_LT(std::abs(x[2]), 1.0 + 1e-9);
    if (std::abs(x[2]) < 1.0 - 1e-6) {
      EXPECT_GT(radius, 1.0 - 1e-3);  // on the side
    }
    on_rim += std::abs(x[2]) > 1.0 - 1e-9 && radius > 1.0 - 1e-3;
  }
  EXPECT_GT(on_rim, 40);
  EXPECT_GE(report.smallest_jacobian, kSmallestJacobian);
}

TEST(QuadraticTets, PoorTetsPullTheirNodesBack) {
  // A thin slab of tets, its lower side dented almost through.
  TetMesh slab = shapes::tet_box(2, 2, 1, 1.0);
  for (Vec3& x : slab.nodes) x[2] *= 0.05;
  std::vector<int> node;
  TriMesh dented = boundary_surface(with_middle_nodes(slab), node);
  for (Vec3& x : dented.vertices)
    if (x[2] == 0.0 && std::abs(std::sin(kPi * x[0]) * std::sin(kPi * x[1])) > 0.5) x[2] = 0.045;
  TetMesh mesh = with_middle_nodes(slab);
  const CurveReport report = curve_boundary(mesh, dented, 60.0);
  EXPECT_GT(report.held_back, 0);
  EXPECT_GE(report.smallest_jacobian, kSmallestJacobian);
  for (int t = 0; t < int(mesh.tets.size()); ++t)
    EXPECT_GE(smallest_jacobian(element_positions<10>(mesh, element_nodes<10>(mesh, t))),
              kSmallestJacobian);
}

// ---- mass and stiffness -----------------------------------------------------------------------

TEST(QuadraticElasticity, RigidMotionsOfACurvedBodyCauseNoForce) {
  const TetMesh mesh = curved(shapes::sphere(1.0, 3), 200);
  const SparseMatrix K = stiffness_matrix(mesh, kRubber);
  VecX u(3 * Eigen::Index(mesh.nodes.size()));
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    u.segment<3>(3 * Eigen::Index(i)) =
        Vec3(0.5, -1.0, 2.0) + Vec3(0.3, 0.7, -0.2).cross(mesh.nodes[i]);
  EXPECT_LT((K * u).norm(), 1e-12 * K.norm() * u.norm());
}

TEST(QuadraticElasticity, LinearStrainHasTheExactEnergy) {
  // u = (x^2, 0, 0) on the unit cube: eps_xx = 2 x, W = (lambda / 2 + mu) 4 / 3.
  const TetMesh mesh = with_middle_nodes(shapes::tet_box(2, 2, 2, 0.5));
  VecX u = VecX::Zero(3 * Eigen::Index(mesh.nodes.size()));
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    u[3 * Eigen::Index(i)] = mesh.nodes[i][0] * mesh.nodes[i][0];
  const double mu = 1e6 / 2.6, lambda = 1e6 * 0.3 / (1.3 * 0.4);
  const double exact = (0.5 * lambda + mu) * 4.0 / 3.0;
  EXPECT_NEAR(0.5 * u.dot(stiffness_matrix(mesh, kRubber) * u), exact, 1e-12 * exact);
}

TEST(QuadraticElasticity, MassIntegratesProductsOfQuadraticFieldsExactly) {
  const TetMesh mesh = with_middle_nodes(shapes::tet_box(2, 1, 1, 0.5));  // 1 x 1/2 x 1/2
  const SparseMatrix M = mass_matrix(mesh, Material{2.0, 1.0, 0.0}, MassKind::kConsistent);
  VecX xx(M.rows()), yz(M.rows());
  for (int i = 0; i < int(M.rows()); ++i) {
    const Vec3& x = mesh.nodes[i];
    xx[i] = x[0] * x[0], yz[i] = x[1] * x[2];
  }
  EXPECT_NEAR(xx.dot(M * xx), 2.0 / 5.0 / 4.0, 1e-14);
  EXPECT_NEAR(xx.dot(M * yz), 2.0 / 3.0 / 64.0, 1e-14);
}

TEST(QuadraticElasticity, MassOfACurvedBodyIsDensityTimesVolumeWithExactInertia) {
  TetMesh mesh = curved(shapes::sphere(1.0, 4), 240);
  move_to_centre_of_mass(mesh);
  const SparseMatrix M = mass_matrix(mesh, kRubber, MassKind::kConsistent);
  EXPECT_NEAR(M.sum(), 1000.0 * mesh_volume(mesh), 1e-9);
  double trace = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    VecX x(M.rows());
    for (int i = 0; i < int(M.rows()); ++i) x[i] = mesh.nodes[i][axis];
    trace += x.dot(M * x);
  }
  // Ball of the same volume: sum m r^2 = 3/5 m R^2; the boundary leaves the sphere by O(h^4).
  const double radius = std::cbrt(0.75 / kPi * mesh_volume(mesh));
  EXPECT_NEAR(trace / (0.6 * M.sum() * radius * radius), 1.0, 2e-5);
}

}  // namespace
}  // namespace archetide
