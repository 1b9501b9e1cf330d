// Bodies under one skin (Section 7) in the coupled solve.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <random>

#include "runtime/cut_cells/clip.h"
#include "runtime/simulation.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dense_eq45.h"
#include "tests/support/dry_body.h"
#include "tests/support/random_vectors.h"
#include "tests/support/skinned_bar.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

Quat oblique() { return Quat(0.9, 0.2, -0.3, 0.25).normalized(); }

std::vector<StageBody> stage_of(const std::vector<ReducedBody>& bodies) {
  std::vector<StageBody> stage;
  for (const ReducedBody& b : bodies)
    stage.push_back({&b, current_configuration(b), {}, false, {}, {}});
  return stage;
}

/// Three points of the cut at x (m) that weld bodies a and b of a bar.
Joint weld(const std::vector<ReducedBody>& bodies, int a, int b, double x) {
  const double h = 0.25 * SkinnedBar::kWidth;
  std::vector<Vec3> points;
  for (const Vec3& p : {Vec3(x, h, h), Vec3(x, -h, h), Vec3(x, 0, -h)})
    points.push_back(p - bodies[a].archetype->centre);
  return make_joint(bodies, a, b, points);
}

// ---- against the dense system -------------------------------------------------------------------

/// Integral of (weight of skin vertex v) n over the surface within each cell, cells x 3 n, m^2.
MatX surface_to_cells(const Grid& g, const std::vector<Vec3>& points, const TriMesh& surface) {
  MatX P = MatX::Zero(static_cast<long>(g.cells()), 3 * static_cast<long>(points.size()));
  for (const Vec3i& t : surface.triangles) {
    Vec3 x[3];
    for (int v = 0; v < 3; ++v) x[v] = (points[t[v]] - g.origin) / g.dx;
    for_each_piece(g, x, [&](const Vec3i& c, const ClipPolygon& piece) {
      const Vec3 area = g.dx * g.dx * vector_area(piece), w = centroid_weights(piece);
      const long cell = c[0] + static_cast<long>(g.nx) * (c[1] + static_cast<long>(g.ny) * c[2]);
      for (int v = 0; v < 3; ++v)
        for (int d = 0; d < 3; ++d) P(cell, 3L * t[v] + d) += w[v] * area[d];
    });
  }
  return P;
}

/// Skin velocities from particle velocities of one part, 3 n x 3 particles: the particle at the
/// same place times the weight.
MatX skinning_matrix(const SkinnedBar& bar, std::size_t part) {
  const SyntheticBody& shape = bar.shapes[part];
  const Skin& skin = *bar.skin.shape->skin;
  MatX S = MatX::Zero(3 * static_cast<long>(skin.surface.vertices.size()),
                      3 * static_cast<long>(shape.nodes().size()));
  for (std::size_t v = 0; v < skin.surface.vertices.size(); ++v) {
    const double weight = skin.weight(v, static_cast<int>(part));
    if (weight == 0.0) continue;
    const Vec3 x = skin.surface.vertices[v] - shape.archetype->centre;
    std::size_t node = 0;
    while (node < shape.nodes().size() && (shape.nodes()[node] - x).norm() > 1e-12) ++node;
    EXPECT_LT(node, shape.nodes().size()) << "vertex " << v << " is no particle of part " << part;
    S.block<3, 3>(3 * static_cast<long>(v), 3 * static_cast<long>(node)) =
        weight * Mat3::Identity();
  }
  return S;
}

struct DenseSkin {
  VecX pressure;             // per unknown cell, dt p' / (rho dx), m/s
  std::vector<VecX> motion;  // particle velocities of each part after the solve, 3 particles
};

/// Eq. 49 on the open fractions of cut cells, W J replaced by (surface in the cell) x (skin from
/// particles): projections, K_lambda and lambda_a literally, 3 particles to a side.
DenseSkin solve_dense(const CoupledTank& tank, const SkinnedBar& bar,
                      const std::vector<Joint>& joints, const Coupling& coupling, double dt) {
  const Grid& g = tank.options.grid;
  const auto& kind = coupling.system().matrix.kind;
  Array3<int> unknown(g.nx, g.ny, g.nz, -1);
  std::vector<long> cells;
  for (std::size_t n = 0; n < kind.size(); ++n)
    if (kind[n] == CellKind::kUnknown) {
      unknown[n] = static_cast<int>(cells.size());
      cells.push_back(static_cast<long>(n));
    }
  const auto nc = static_cast<long>(cells.size());
  const double area = g.dx * g.dx, mass = tank.options.hydrostatics.density * area * g.dx;

  // water: D b^-1 D^T with D = area w on each face, outward positive
  MatX A = MatX::Zero(nc, nc);
  VecX rhs = VecX::Zero(nc);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i < g.nx; ++i) {
          const Vec3i high(i, j, k), low = high - Vec3i::Unit(a);
          if (low[a] < 0) continue;
          const int p = unknown(low[0], low[1], low[2]), q = unknown(i, j, k);
          const double w = coupling.open()[a](i, j, k), c = area * area * w / mass;
          const double flux = area * w * tank.u[a](i, j, k);
          if (p >= 0) A(p, p) += c, rhs[p] -= flux;
          if (q >= 0) A(q, q) += c, rhs[q] += flux;
          if (p >= 0 && q >= 0) A(p, q) -= c, A(q, p) -= c;
        }

  // bodies
  std::vector<Vec3> points;
  skin_points(
      bar.skin, [&](int b) -> const ReducedBody& { return tank.bodies[b]; }, points);
  const MatX P = surface_to_cells(g, points, bar.skin.shape->skin->surface)(cells, Eigen::all);
  long na = 0;
  for (const Joint& joint : joints) na += 3 * static_cast<long>(joint.at_a.size());
  MatX a_23 = MatX::Zero(nc, na), a_33 = MatX::Zero(na, na);
  VecX rhs_a = VecX::Zero(na);
  std::vector<MatX> PS, K, J;
  std::vector<VecX> v_star;
  for (std::size_t b = 0; b < tank.bodies.size(); ++b) {
    const ReducedBody& body = tank.bodies[b];
    const FreeMotion motion =
        free_motion(body, current_configuration(body), VecX::Zero(body.dofs()), dt,
                    Stage::kVelocityFull, tank.options.modal);
    K.push_back(dense_impulse_factor(body, bar.shapes[b], motion.H.M_hat));
    v_star.push_back(dense_motion(body, bar.shapes[b]) * motion.y_star);
    PS.push_back(P * skinning_matrix(bar, b));
    J.push_back(MatX::Zero(na, v_star[b].size()));
    long row = 0;
    for (const Joint& joint : joints)
      for (std::size_t n = 0; n < joint.at_a.size(); ++n, row += 3)
        for (const auto& [which, at, sign] :
             {std::tuple(joint.a, joint.at_a[n], 1.0), std::tuple(joint.b, joint.at_b[n], -1.0)}) {
          if (which != static_cast<int>(b)) continue;
          const auto& nodes = bar.shapes[b].nodes();
          for (std::size_t node = 0; node < nodes.size(); ++node)
            if ((nodes[node] - at.rest).norm() < 1e-12)
              J[b].block<3, 3>(row, 3 * static_cast<long>(node)) = sign * Mat3::Identity();
        }
    A += PS[b] * K[b] * PS[b].transpose();
    rhs += PS[b] * v_star[b];
    a_23 -= PS[b] * K[b] * J[b].transpose();
    a_33 += J[b] * K[b] * J[b].transpose();
    rhs_a -= J[b] * v_star[b];
  }
  MatX whole(nc + na, nc + na);
  whole << A, a_23, a_23.transpose(), a_33;
  VecX load(nc + na);
  load << rhs, rhs_a;
  const VecX x = solve_semi_definite(whole, load);
  DenseSkin out;
  out.pressure = x.head(nc) / (tank.options.hydrostatics.density * g.dx);
  for (std::size_t b = 0; b < K.size(); ++b)
    out.motion.push_back(v_star[b] +
                         K[b] * (J[b].transpose() * x.tail(na) - PS[b].transpose() * x.head(nc)));
  return out;
}

class SkinOracle : public ::testing::TestWithParam<bool> {};

TEST_P(SkinOracle, FastPathEqualsDenseEquation49) {
  const bool jointed = GetParam();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  CoupledTank tank(8, 0.6);
  tank.options.solve.tolerance = 1e-13;
  SkinnedBar bar =
      skinned_bar({-0.3, -0.1, 0.1, 0.3}, 0.2, 0.1, 3, 600.0, Vec3(0.02, -0.03, 0.05), oblique());
  tank.bodies = bar.bodies;
  for (ReducedBody& body : tank.bodies) {
    for (int i = 0; i < body.r; ++i)
      body.q[i] = 0.02 * normal(random), body.q_dot[i] = normal(random);
    body.P = 3.0 * random_vec3(normal, random);
    body.L = 0.3 * random_vec3(normal, random);
  }
  for (auto& component : tank.u.axis)
    for (std::size_t n = 0; n < component.size(); ++n) component[n] = normal(random);
  close_sides(tank.options.grid, tank.options.open_side, tank.u);
  std::vector<Joint> joints;
  if (jointed)
    for (const int b : {1, 2}) {  // corners of the cut's plane: particles of both
      Joint joint;
      joint.a = b, joint.b = b - 1;
      const double x = b == 1 ? -0.1 : 0.1;
      for (const Vec3& p : {Vec3(x, 0.1, 0.1), Vec3(x, -0.1, 0.1), Vec3(x, 0.1, -0.1)}) {
        joint.at_a.push_back(attach(tank.bodies[b], p - tank.bodies[b].archetype->centre));
        joint.at_b.push_back(attach(tank.bodies[b - 1], p - tank.bodies[b - 1].archetype->centre));
      }
      joints.push_back(joint);
    }

  const double dt = 0.02;
  Coupling coupling(tank.options, {}, joints, {bar.skin});
  MacField u = tank.u;
  const SolveReport report = coupling.couple(Stage::kVelocityFull, dt, {&tank.phi, nullptr, 0.0},
                                             stage_of(tank.bodies), u, tank.results);
  EXPECT_TRUE(report.converged) << report.residual;
  const DenseSkin dense = solve_dense(tank, bar, joints, coupling, dt);
  double worst = 0.0, speed = 0.0;
  for (std::size_t b = 0; b < tank.bodies.size(); ++b) {
    const VecX v = dense_motion(tank.bodies[b], bar.shapes[b]) * tank.results[b].y;
    worst = std::max(worst, (v - dense.motion[b]).cwiseAbs().maxCoeff());
    speed = std::max(speed, dense.motion[b].cwiseAbs().maxCoeff());
  }
  const auto& kind = coupling.system().matrix.kind;
  const Array3<double>& pressure = coupling.last_pressure(Stage::kVelocityFull);
  VecX fast(dense.pressure.size());
  long unknown = 0;
  for (std::size_t n = 0; n < kind.size(); ++n)
    if (kind[n] == CellKind::kUnknown) fast[unknown++] = pressure[n];
  const double off =
      (fast - dense.pressure).cwiseAbs().maxCoeff() / dense.pressure.cwiseAbs().maxCoeff();
  std::printf("%s: velocities off by %.1e, pressure by %.1e, %d iterations, divergence %.1e 1/s\n",
              jointed ? "welded" : "loose", worst / speed, off, report.iterations,
              coupling.last_divergence());
  EXPECT_LT(worst / speed, 1e-10);
  EXPECT_LT(off, 1e-10);
}
INSTANTIATE_TEST_SUITE_P(Bars, SkinOracle, ::testing::Bool());

// ---- against the whole --------------------------------------------------------------------------

/// Velocity (v, w) of a body after one coupled solve from rest in still water.
struct Solved {
  std::vector<VecX> y;
  int iterations = 0;
};
Solved release(const std::vector<ReducedBody>& bodies, const std::vector<Joint>& joints,
               const std::vector<SkinnedBodies>& skins) {
  CoupledTank tank(32, 0.8);
  tank.options.open_side[kZMax] = true;
  tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
  tank.options.hydrostatics.reference = Vec3(0, 0, 0.8);
  Coupling coupling(tank.options, {}, joints, skins);
  const SolveReport report = coupling.couple(Stage::kVelocityFull, 0.01, {&tank.phi, nullptr, 0.0},
                                             stage_of(bodies), tank.u, tank.results);
  EXPECT_TRUE(report.converged);
  Solved out;
  out.iterations = report.iterations;
  for (const StageResult& r : tank.results) out.y.push_back(r.y);
  return out;
}

TEST(SkinnedBar, WeldedRigidPartsMoveAsTheWhole) {
  const Vec3 place(0.03, -0.02, 0.04);
  const double density = 500.0;
  const SkinnedBar bar =
      skinned_bar({-0.3, -0.05, 0.1, 0.3}, 0.15, 0.0, 0, density, place, oblique());
  const SkinnedBar one = skinned_bar({-0.3, 0.3}, 0.15, 0.0, 0, density, place, oblique());
  const std::vector<Joint> welds = {weld(bar.bodies, 0, 1, -0.05), weld(bar.bodies, 1, 2, 0.1)};
  const Solved parts = release(bar.bodies, welds, {bar.skin});
  const Solved whole = release(one.bodies, {}, {one.skin});
  const Solved plain = release(one.bodies, {}, {});
  const Vec3 v = whole.y[0].head<3>(), spin = whole.y[0].segment<3>(3);
  double worst = 0.0;
  for (std::size_t b = 0; b < bar.bodies.size(); ++b) {
    const Vec3 arm = bar.bodies[b].position - one.bodies[0].position;
    worst = std::max({worst, (parts.y[b].head<3>() - v - spin.cross(arm)).norm(),
                      0.3 * (parts.y[b].segment<3>(3) - spin).norm()});
  }
  const double carried = (plain.y[0].head<3>() - v).norm() / v.norm();
  std::printf(
      "welded parts off the whole by %.1e; without the carried water the whole is off by "
      "%.1e; iterations %d, %d\n",
      worst / v.norm(), carried, parts.iterations, whole.iterations);
  EXPECT_LT(worst / v.norm(), 1e-10);
  EXPECT_LT(carried, 0.03);                // 4 cells across the bar; 7.0e-2 with 2 cells
  EXPECT_GT(v.norm(), 0.01 * 9.81 * 0.1);  // it does rise
}

// A skin and welds hardly change the spectrum: 1.5 times the iterations would be allowed.
TEST(SkinnedBar, TakesNoMoreIterationsThanLooseParts) {
  const SkinnedBar bar =
      skinned_bar({-0.3, -0.1, 0.1, 0.3}, 0.2, 0.0, 6, 900.0, Vec3(0.03, -0.02, 0.04), oblique());
  const std::vector<Joint> welds = {weld(bar.bodies, 0, 1, -0.1), weld(bar.bodies, 1, 2, 0.1)};
  const int loose = release(bar.bodies, {}, {}).iterations,
            skinned = release(bar.bodies, welds, {bar.skin}).iterations;
  std::printf("loose %d iterations, welded under a skin %d\n", loose, skinned);
  EXPECT_LE(skinned, 1.5 * loose);
}

// ---- at rest ------------------------------------------------------------------------------------

TEST(SkinnedBar, NeutralPartsHoverJointedOrNot) {
  for (const bool jointed : {false, true})
    for (const double level : {0.8, double(INFINITY)}) {
      SimulationOptions o;
      const int n = 16;
      o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
      o.has_water = true;
      o.open_side[kZMax] = true;
      o.reference_point = Vec3(0, 0, std::min(level, 1.0));
      const SkinnedBar bar =
          skinned_bar({-0.3, 0.02, 0.3}, 0.15, 0.0, 0, 1000.0, Vec3(0.51, 0.48, 0.42), oblique());
      std::vector<Joint> joints;
      if (jointed) joints.push_back(weld(bar.bodies, 0, 1, 0.02));
      Simulation s(o, water_to(o.grid, level), bar.bodies, {}, {}, joints, {bar.skin});
      double fastest = 0.0;
      for (int step = 0; step < 20; ++step) fastest = std::max(fastest, s.step(0.02).max_speed);
      const double scale = std::sqrt(9.81 * SkinnedBar::kWidth);
      std::printf("%s, level %.1f: largest speed %.1e sqrt(g a)\n", jointed ? "welded" : "loose",
                  level, fastest / scale);
      EXPECT_LT(fastest, 1e-9 * scale);
    }
}

// Half out of the water, a bar of welded parts under a skin floats like the plain bar (a square one
// is stable above 0.79 of the water's density).
TEST(SkinnedBar, ItsDraftIsThatOfThePlainBody) {
  double height[2];
  for (const bool skinned : {false, true}) {
    SimulationOptions o;
    const int n = 20;
    o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
    o.has_water = true;
    o.open_side[kZMax] = true;
    o.reference_point = Vec3(0, 0, 0.5);
    const SkinnedBar bar = skinned_bar({-0.3, -0.05, 0.3}, 0.15, 0.0, 0, 850.0,
                                       Vec3(0.5, 0.5, 0.43), Quat::Identity());
    const SkinnedBar one =
        skinned_bar({-0.3, 0.3}, 0.15, 0.0, 0, 850.0, Vec3(0.5, 0.5, 0.43), Quat::Identity());
    std::vector<Joint> joints;
    std::vector<SkinnedBodies> skins;
    if (skinned) joints = {weld(bar.bodies, 0, 1, -0.05)}, skins = {bar.skin};
    Simulation s(o, water_to(o.grid, 0.5), skinned ? bar.bodies : one.bodies, {}, {}, joints,
                 skins);
    double mass = 0.0, z = 0.0, drift = 0.0;
    for (int step = 0; step < 50; ++step) drift = std::max(drift, s.step(0.02).joint_drift);
    for (const ReducedBody& b : s.bodies()) {
      mass += b.archetype->integrals.mass;
      z += b.archetype->integrals.mass * b.position.z();
    }
    height[skinned] = z / mass;
    std::printf("%s: at %.6f m after 1 s, joint gap %.1e m\n", skinned ? "skinned" : "plain",
                height[skinned], drift);
    EXPECT_LE(drift, 1e-10);
  }
  const double w = SkinnedBar::kWidth;
  EXPECT_NEAR(height[0], 0.43, 5e-3 * w);
  EXPECT_NEAR(height[1], height[0], 2e-3 * w);
}

// Without water, half outside the tank, and within a single cell: steps without a fault, joints
// closed.
TEST(SkinnedBar, StepsInVacuumAcrossTheTanksSideAndWithinACell) {
  const Quat turn = oblique();
  struct Case {
    const char* name;
    int cells;
    Vec3 place;
  };
  for (const Case& c : {Case{"dry", 0, Vec3(0.5, 0.5, 0.5)}, Case{"side", 12, Vec3(1.0, 0.5, 0.6)},
                        Case{"cell", 1, Vec3(0.4, 0.5, 0.45)}}) {
    SimulationOptions o;
    o.wall_contact = false;
    o.open_side[kZMax] = true;
    if (c.cells > 0) {
      o.grid = {c.cells, c.cells, c.cells, 1.0 / c.cells, Vec3::Zero()};
      o.has_water = true;
    }
    const SkinnedBar bar = skinned_bar({-0.3, -0.1, 0.3}, 0.2, 0.0, 4, 800.0, c.place, turn);
    Simulation s(o, c.cells > 0 ? water_to(o.grid, INFINITY) : FluidState(), bar.bodies, {}, {},
                 {weld(bar.bodies, 0, 1, -0.1)}, {bar.skin});
    double drift = 0.0;
    for (int step = 0; step < 5; ++step) drift = std::max(drift, s.step(0.005).joint_drift);
    std::vector<Vec3> points;
    skin_points(
        s.skins()[0], [&](int b) -> const ReducedBody& { return s.bodies()[b]; }, points);
    double far = 0.0;
    for (const Vec3& x : points) far = std::max(far, (x - c.place).norm());
    std::printf("%s: joint gap %.1e m, farthest point %.3f m\n", c.name, drift, far);
    EXPECT_LE(drift, 1e-10);
    EXPECT_LE(far, 0.5);  // the bar reaches 0.33 m
  }
}

}  // namespace
}  // namespace archetide
