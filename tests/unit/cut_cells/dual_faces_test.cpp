#include "runtime/cut_cells/dual_faces.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>
#include <random>

#include "runtime/cut_cells/surface_sweep.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/random_vectors.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// A full tank of n^3 cells of 1 m with one body in it, ready to be solved.
struct CutTank {
  CoupledTank tank;
  FaceField<double> open;
  DualFaces faces;
  BodyFlux raw, flux;  // F of the surface; with what the faces took
  PressureSystem system;
  MatX carried;  // kg

  CutTank(int n, const ReducedBody& body) : tank(n, 0.5 * n) {
    const Grid& g = tank.options.grid;
    SolidFractions solids;
    solids.face.resize(g, 0.0);
    solids.cell.resize(n, n, n, 0.0);
    const BodySurface surface = body_surface(body, ModalMass::kExact);
    raw = flux = cut_body(g, surface, solids, faces);
    open.resize(g, 1.0);
    for (int a = 0; a < 3; ++a)
      for (std::size_t f = 0; f < open[a].size(); ++f) open[a][f] -= solids.face[a][f];
    close_sides(g, {}, open);
    assemble_pressure_system(g, {&tank.phi}, open, {}, {}, {&faces}, system);
    carried = carried_water(g, faces, 1000.0, PlacedInnerFlow(inner_flow(*body.archetype), surface),
                            flux);
  }
};

ReducedBody turned_body(const std::shared_ptr<const Archetype>& archetype, int n) {
  ReducedBody body = make_body(archetype, archetype->r());
  std::mt19937 random(n);
  std::uniform_real_distribution<double> u(-0.5, 0.5);
  body.position = random_vec3(u, random);
  const Vec3 turn = random_vec3(u, random);
  if (n % 2) body.rotation = Quat(1.0, turn[0], turn[1], turn[2]).normalized();
  return body;
}

std::vector<std::shared_ptr<const Archetype>> shapes() {
  return {rigid_surface_archetype(volume_true_sphere(4, 4.0), 1000.0),
          rigid_surface_archetype(box_surface(Vec3(7.3, 5.2, 6.4), 4), 1000.0)};
}

TEST(MeanCurvature, OfSphereAndBox) {
  const TriMesh sphere = volume_true_sphere(4, 2.5);
  const std::vector<double> of_sphere = mean_curvature(sphere.vertices, sphere.triangles);
  double sum = 0.0, area = 0.0;
  for (const Vec3i& t : sphere.triangles) {
    const Vec3 &a = sphere.vertices[t[0]], &b = sphere.vertices[t[1]], &c = sphere.vertices[t[2]];
    const double size = 0.5 * (b - a).cross(c - a).norm();
    area += size;
    for (int v = 0; v < 3; ++v) sum += size / 3.0 * of_sphere[t[v]];
  }
  EXPECT_NEAR(sum / area, 0.4, 0.4 * 2e-3);
  // A third of the triangles around is not the vertex's own area where five meet.
  for (double kappa : of_sphere) EXPECT_NEAR(kappa, 0.4, 0.4 * 0.2);
  // A box is flat but at its edges.
  const TriMesh box = box_surface(Vec3::Constant(2.0), 4);
  const std::vector<double> kappa = mean_curvature(box.vertices, box.triangles);
  for (std::size_t v = 0; v < kappa.size(); ++v) {
    const int edges = static_cast<int>((box.vertices[v].cwiseAbs().array() > 1.0 - 1e-9).count());
    if (edges == 1)
      EXPECT_NEAR(kappa[v], 0.0, 1e-12);
    else
      EXPECT_GT(kappa[v], 0.1);
  }
}

// Water and body moving as one, u = v: e and the carried water are all of the water's mass, along
// every axis, at any position (round-off of sums over 16^3 cells).
TEST(DualFaces, HoldAllOfTheWater) {
  constexpr int n = 16;
  for (const auto& archetype : shapes())
    for (int trial = 0; trial < 10; ++trial) {
      const CutTank t(n, turned_body(archetype, trial));
      // Dual cells of the faces within the tank: its volume less half a cell at two sides.
      const double water = n * n * (n - 1) - archetype->volume;
      for (int a = 0; a < 3; ++a) {
        double sum = t.carried(a, a) / 1000.0;
        for (std::size_t f = 0; f < t.open[a].size(); ++f) sum += t.system.matrix.w[a][f];
        EXPECT_NEAR(sum / water, 1.0, 1e-12);
      }
    }
}

// u = v pushes nothing into any cell: F of a translation is the divergence of e.
TEST(DualFaces, UniformMotionIsExact) {
  for (const auto& archetype : shapes())
    for (int trial = 0; trial < 10; ++trial) {
      const CutTank t(16, turned_body(archetype, trial));
      const auto& e = t.system.matrix.w;
      const Grid& g = t.tank.options.grid;
      for (std::size_t m = 0; m < t.flux.cell.size(); ++m) {
        const auto n = static_cast<int>(t.flux.cell[m]);
        const int i = n % g.nx, j = n / g.nx % g.ny, k = n / g.nx / g.ny;
        for (int a = 0; a < 3; ++a)
          EXPECT_NEAR(t.flux.flux(a, static_cast<Eigen::Index>(m)),
                      e[a](i + (a == 0), j + (a == 1), k + (a == 2)) - e[a](i, j, k), 1e-11);
      }
      // What it takes from one cell it gives to the next, of spins too.
      const VecX net = (t.flux.flux - t.raw.flux).rowwise().sum();
      EXPECT_LE(net.cwiseAbs().maxCoeff(), 1e-11);
    }
}

// Momentum that water, carried water and body gain in a solve is what the tank's sides give, by
// summation by parts: round-off, whatever the solver's tolerance.
TEST(DualFaces, MomentumOfWaterBodyAndWallsIsAccounted) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const auto& archetype : shapes())
    for (int trial = 0; trial < 4; ++trial) {
      CoupledTank tank(16, 8.0);
      tank.options.solve.tolerance = 1e-4;
      ReducedBody body = turned_body(archetype, trial);
      body.mass_scale = trial < 2 ? 0.7 : 0.05;
      body.P = Vec3(1.0, -2.0, 0.5) * archetype->integrals.mass;
      for (auto& component : tank.u.axis)
        for (std::size_t n = 0; n < component.size(); ++n) component[n] = normal(random);
      close_sides(tank.options.grid, {}, tank.u);
      Coupling coupling(tank.options, {});
      const std::vector<StageBody> stage{{&body, current_configuration(body), {}, false, {}}};
      std::vector<StageResult> results;
      coupling.couple(Stage::kVelocityFull, 0.01, {&tank.phi}, stage, tank.u, results);

      const Motion water = coupling.motion_after() - coupling.motion_before();
      const Array3<double>& phi = coupling.last_pressure(Stage::kVelocityFull);
      for (int a = 0; a < 3; ++a) {
        double sides = 0.0;
        for (int q = 0; q < 16; ++q)
          for (int p = 0; p < 16; ++p) {
            Vec3i low, high;
            low[a] = 0, high[a] = 15;
            low[(a + 1) % 3] = high[(a + 1) % 3] = p;
            low[(a + 2) % 3] = high[(a + 2) % 3] = q;
            sides += 1000.0 * (phi(low[0], low[1], low[2]) - phi(high[0], high[1], high[2]));
          }
        const double gained = water.P[a] + results[0].delta_P[a];
        EXPECT_NEAR(gained, sides, 1e-9 * body.P.norm()) << a;
        EXPECT_NEAR(results[0].delta_P[a], results[0].water_impulse[a], 1e-9 * body.P.norm());
      }
    }
}

// A mode without a net flux but for the mesh's has none at all; one that breathes keeps it.
TEST(BodyFlux, OfModesThatKeepTheVolumeHasNoNetPart) {
  const TetMesh tets = blob_tets(3, Vec3(6.0, 5.0, 4.0), Vec3i(4, 3, 3));
  MatX shapes(3 * static_cast<Eigen::Index>(tets.nodes.size()), 2);
  for (std::size_t n = 0; n < tets.nodes.size(); ++n) {
    const Vec3& x = tets.nodes[n];
    const auto row = 3 * static_cast<Eigen::Index>(n);
    shapes.block<3, 1>(row, 0) = Vec3(x[0], -x[1] * (1.0 - 1e-4), 0.0);  // a shear, nearly
    shapes.block<3, 1>(row, 1) = x;                                      // a breath
  }
  const VecX omega = VecX::Constant(2, 10.0);
  const ReducedBody body =
      make_body(deformable_archetype(tets, 1000.0, shapes, omega).archetype, 2);
  const CutTank t(16, body);
  const VecX gross = t.raw.flux.cwiseAbs().rowwise().sum(), net = t.raw.flux.rowwise().sum();
  EXPECT_LT(std::abs(net[6]), 1e-13 * gross[6]);
  EXPECT_GT(std::abs(net[7]), 0.5 * gross[7]);
}

TEST(DualFaces, LightBodiesKeepFourFifthsOfTheirMass) {
  for (const auto& archetype : shapes())
    for (int trial = 0; trial < 10; ++trial) {
      ReducedBody body = turned_body(archetype, trial);
      body.mass_scale = 1e-4;
      CutTank t(16, body);
      const MatX H =
          generalised_mass(
              body, configuration_terms(body, current_configuration(body), ModalMass::kExact), 0.0,
              Stage::kVelocityFull, ModalStep::kTrapezoid)
              .dense();
      bound_carried_water(H, t.carried);
      const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(H + t.carried, H);
      EXPECT_GT(eigen.eigenvalues().minCoeff(), 0.8 - 1e-9);
    }
}

/// A ball of tets: the shells of a cube of n^3 cells made round.
TetMesh ball_tets(double radius, int n) {
  TetMesh tets = box_tets(2.0 * radius * Vec3::Ones(), Vec3i(n, n, n));
  for (Vec3& x : tets.nodes)
    if (x.norm() > 0.0) x *= x.cwiseAbs().maxCoeff() / x.norm();
  return tets;
}

// Of a soft ball of 4 cells per radius and half the water's density nothing is taken off.
TEST(DualFaces, SoftBallsOfHalfTheWatersDensityKeepAllCarriedWater) {
  SyntheticOptions soft;
  soft.density = 500.0;
  soft.r = 10;
  const auto archetype = deformable_archetype(ball_tets(4.0, 8), soft).archetype;
  double least = 0.0;
  for (int trial = 0; trial < 40; ++trial) {
    const ReducedBody body = turned_body(archetype, trial);
    const CutTank t(16, body);
    const MatX H =
        generalised_mass(body,
                         configuration_terms(body, current_configuration(body), ModalMass::kExact),
                         0.0, Stage::kVelocityFull, ModalStep::kTrapezoid)
            .dense();
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(t.carried, H);
    least = std::min(least, eigen.eigenvalues().minCoeff());
    MatX bounded = t.carried;
    bound_carried_water(H, bounded);
    EXPECT_EQ(bounded, t.carried);
  }
  std::printf("measured: least eigenvalue %.3f, bound -0.2\n", least);
}

}  // namespace
}  // namespace archetide
