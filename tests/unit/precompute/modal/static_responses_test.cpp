#include "precompute/modal/static_responses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "precompute/base/tet_element.h"
#include "precompute/meshing/quadratic_tets.h"
#include "precompute/meshing/tetrahedralize.h"
#include "precompute/modal/modes.h"
#include "precompute/modal/ordering.h"
#include "tests/unit/precompute/shapes.h"
#include "tests/unit/precompute/wet_sphere.h"

namespace archetide {
namespace {

TetMesh ball(int target) {
  TetrahedralizeOptions options;
  options.target = target;
  options.order = 2;
  TetMesh mesh = tetrahedralize(shapes::sphere(1.0, 5), options).mesh;
  move_to_centre_of_mass(mesh);
  return mesh;
}

ModesResult modes_of(const TetMesh& mesh, int count, const StaticLoads& loads) {
  Profile profile;
  ModesOptions options;
  options.count = count;
  options.loads = loads;
  return compute_modes(mesh, kRubber, options, profile);
}

TEST(StaticResponses, PressureVectorsRestoreTheWetFrequencyOfTheSphere) {
  const TetMesh mesh = ball(1300);
  StaticLoads loads;
  loads.pressure = true;
  const ModesResult modes = modes_of(mesh, 10, loads);  // T2 and S2: one dry mode for each (n, m)
  ASSERT_EQ(modes.vibration_modes(), 10);
  EXPECT_EQ(modes.static_count, 5);  // torsional modes press on nothing
  // Coupled elastic sphere in unbounded liquid, nu = 0.3, n = 2, s = 0.5: x = 1.673954822; with one
  // dry mode 3.1 % too high, with one dry and one static vector 0.12 % (closed form).
  const double exact = wet_sphere::kExact, rho = 2.0 * kRubber.density;
  const double dry = wet_sphere::lowest(mesh, modes, 10, kRubber, rho) / exact - 1.0;
  const double wet = wet_sphere::lowest(mesh, modes, 15, kRubber, rho) / exact - 1.0;
  EXPECT_NEAR(dry, 0.0308, 0.001);
  EXPECT_LT(std::abs(wet), 0.002);  // asked for; closed form 0.00124
}

TEST(StaticResponses, AreOrthonormalAndDiagonalWithTheModes) {
  const TetMesh mesh = ball(240);
  StaticLoads loads;
  loads.pressure = loads.gravity = true;
  loads.nodes = {{0, 5, 9}};
  const ModesResult modes = modes_of(mesh, 10, loads);
  const Eigen::Index r = modes.omega2.size();
  EXPECT_GE(modes.static_count, 9);
  EXPECT_LT((modes.M_r - MatX::Identity(r, r)).cwiseAbs().maxCoeff(), 1e-10);
  const MatX diagonal = modes.omega2.asDiagonal();
  EXPECT_LT((modes.K_r - diagonal).norm(), 1e-8 * diagonal.norm());
  EXPECT_TRUE(std::is_sorted(modes.omega2.begin(), modes.omega2.end()));
  EXPECT_LT(modes.rigid_content, 1e-12);
  EXPECT_LT(modes.residuals.head(10).maxCoeff(), 1e-8);
  EXPECT_GT(modes.residuals.tail(modes.static_count).minCoeff(),
            1e-3);  // they solve no eigenproblem
}

TEST(StaticResponses, BasisAnswersItsLoadsAsTheWholeBodyDoes) {
  const TetMesh mesh = ball(240);
  const std::vector<int> pulled = {0, 3};
  StaticLoads loads;
  loads.gravity = true;
  loads.nodes = {pulled};
  const ModesResult modes = modes_of(mesh, 5, loads);
  const SparseMatrix K = stiffness_matrix(mesh, kRubber);
  const SparseMatrix M = mass_matrix(mesh, kRubber, MassKind::kConsistent);
  const std::vector<BoundaryPoint> points = boundary_points(mesh);
  const Eigen::Index n = 3 * Eigen::Index(mesh.nodes.size());
  VecX pressure(Eigen::Index(points.size()));
  for (Eigen::Index i = 0; i < pressure.size(); ++i)
    pressure[i] = points[std::size_t(i)].position[2];
  VecX pull = VecX::Zero(n);
  for (const int i : pulled) pull[3 * i + 1] = 0.5;
  for (const VecX& f : {pull, pressure_load(mesh, points, pressure)}) {
    // u = Phi K_r^-1 Phi^T f must balance f up to forces of a rigid acceleration, M times a rigid
    // motion: what is left does no work on any motion that carries no momentum.
    const VecX u =
        modes.node_modes * (modes.node_modes.transpose() * f).cwiseQuotient(modes.omega2);
    MatX rigid(n, 6);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
      for (int k = 0; k < 3; ++k) {
        rigid.block<3, 1>(3 * Eigen::Index(i), k) = Vec3::Unit(k);
        rigid.block<3, 1>(3 * Eigen::Index(i), 3 + k) = Vec3::Unit(k).cross(mesh.nodes[i]);
      }
    const MatX weighted = apply_mass(M, rigid);
    const VecX rest = f - K * u;
    const VecX fit = weighted * weighted.colPivHouseholderQr().solve(rest);
    EXPECT_LT((rest - fit).norm(), 1e-6 * f.norm());
  }
}

TEST(BoundaryPoints, IntegrateTheBoundaryOfCurvedTets) {
  const TetMesh mesh = ball(240);
  double volume = 0.0, area = 0.0;
  Vec3 closed = Vec3::Zero();
  for (const BoundaryPoint& p : boundary_points(mesh)) {
    volume += p.position.dot(p.area) / 3.0;  // divergence theorem
    area += p.area.norm();
    closed += p.area;
  }
  EXPECT_NEAR(volume, mesh_volume(mesh), 1e-13);  // degree 4: exact
  EXPECT_LT(closed.norm(), 1e-14);
  EXPECT_NEAR(area / (4.0 * std::numbers::pi), 1.0, 1e-3);  // quadratic faces, h^4
}

TEST(PressureLoad, OfUnitPressureIsMinusTheVectorArea) {
  for (const TetMesh& mesh :
       {shapes::tet_box(2, 2, 2, 0.5), with_middle_nodes(shapes::tet_box(2, 2, 2, 0.5))}) {
    const std::vector<BoundaryPoint> points = boundary_points(mesh);
    const VecX f = pressure_load(mesh, points, VecX::Ones(Eigen::Index(points.size())));
    Vec3 total = Vec3::Zero();
    double work = 0.0;  // on u = x: minus pressure times the change of volume, 3 V
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      total += f.segment<3>(3 * Eigen::Index(i));
      work += f.segment<3>(3 * Eigen::Index(i)).dot(mesh.nodes[i]);
    }
    EXPECT_LT(total.norm(), 1e-14);
    EXPECT_NEAR(work, -3.0, 1e-13);
  }
}

}  // namespace
}  // namespace archetide
