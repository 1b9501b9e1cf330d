#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/params/cli.h"
#include "precompute/base/tet_element.h"
#include "precompute/build.h"
#include "precompute/modal/cubature_error.h"
#include "precompute/modal/energy_cubature.h"
#include "precompute/modal/modes.h"
#include "precompute/modal/static_balance.h"
#include "tests/nonlinear/box_mesh.h"

namespace archetide {
namespace {

// Displacements and changes of volume under given dead loads, against the full neo-Hookean solid
// solved with GetFEM 5.4.2 (hexahedra of degree 2, its own derivatives of the energy): E = 1 Pa,
// Poisson's ratio 0.4, on a quarter or an eighth of the body.
const Material kMaterial{1.0, 1.0, 0.4};

/// A load that is linear in its size: nodal forces per unit, and what it is conjugate to.
struct Load {
  VecX forces;   // 3n, N for a load of 1
  double scale;  // displacement = scale * forces . u
};

/// Integral of the density b(c, x) (N/m^3) over every tet, c its centroid.
template <class Density>
VecX body_load(const TetMesh& mesh, const Density& b) {
  VecX f = VecX::Zero(3 * Eigen::Index(mesh.nodes.size()));
  const ShapeTable<10> rule(conical_rule(4));
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const auto nodes = element_nodes<10>(mesh, t);
    const auto x = element_positions<10>(mesh, nodes);
    const Vec3 centre = x.leftCols<4>().rowwise().mean();
    for (std::size_t k = 0; k < rule.values.size(); ++k) {
      const double w = rule.rule.weights[k] * Mat3(x * rule.gradients[k].transpose()).determinant();
      for (int i = 0; i < 10; ++i)
        f.segment<3>(3 * nodes[i]) += w * rule.values[k][i] * b(centre, x * rule.values[k]);
    }
  }
  return f;
}

/// Integral of the traction p(x) (Pa) over the faces that are `on` with all their nodes.
template <class On, class Traction>
VecX face_load(const TetMesh& mesh, const On& on, const Traction& p) {
  VecX f = VecX::Zero(3 * Eigen::Index(mesh.nodes.size()));
  for (const BoundaryPoint& point : boundary_points(mesh)) {
    bool all = true;
    for (int i = 0; i < point.count; ++i) all = all && on(mesh.nodes[point.nodes[i]]);
    if (!all) continue;
    for (int i = 0; i < point.count; ++i)
      f.segment<3>(3 * point.nodes[i]) += point.N[i] * point.area.norm() * p(point.position);
  }
  return f;
}

struct Reference {
  double load, displacement, volume_change;
};

struct Reduced {
  TetMesh mesh;
  ModesResult modes;
  TrainedCubature trained;
};

Reduced reduce(TetMesh mesh, int count, int derivatives) {
  Reduced body{std::move(mesh), {}, {}};
  move_to_centre_of_mass(body.mesh, kMaterial);
  ModesOptions options;
  options.count = count;
  options.nonlinear = true;
  options.derivatives = derivatives;
  Profile profile;
  body.modes = compute_modes(body.mesh, kMaterial, options, profile);
  body.trained = train_cubature(body.mesh, kMaterial, body.modes.node_modes, body.modes.K_r, {});
  return body;
}

double volume(const TetMesh& mesh, const VecX& u) {
  TetMesh moved = mesh;
  for (std::size_t v = 0; v < moved.nodes.size(); ++v)
    moved.nodes[v] += u.segment<3>(3 * Eigen::Index(v));
  return mesh_volume(moved);
}

/// Prints each load's displacement error and asserts the limits; linear modes beside.
void compare(const char* name, const Reduced& body, const Load& load,
             const std::vector<Reference>& references, double limit, double volume_limit) {
  const MatX& S = body.modes.node_modes;
  const VecX g = S.transpose() * load.forces;
  const double rest = mesh_volume(body.mesh);
  VecX q = VecX::Zero(S.cols());
  std::printf("%s: r = %d, %d points, force error %.1f %%\n", name, int(S.cols()),
              int(body.trained.energy.points()), 100 * body.trained.error);
  for (const Reference& ref : references) {
    q = static_balance(body.trained.energy, ref.load * g, q, 1e-10);
    const double error = load.scale * g.dot(q) / ref.displacement - 1.0;
    const double grown = volume(body.mesh, S * q) / rest - 1.0 - ref.volume_change;
    const VecX linear = ref.load * body.modes.K_r.ldlt().solve(g);
    std::printf(
        "  displacement %.3f: %+.2f %%, volume %+.2f %%; linear modes %+.2f %%, volume %+.2f %%\n",
        ref.displacement, 100 * error, 100 * grown,
        100 * (load.scale * g.dot(linear) / ref.displacement - 1.0),
        100 * (volume(body.mesh, S * linear) / rest - 1.0 - ref.volume_change));
    EXPECT_LT(std::abs(error), limit) << name << " at " << ref.displacement;
    EXPECT_LT(std::abs(grown), volume_limit) << name << " at " << ref.displacement;
  }
}

// 10 x 1 x 1 m, unit tractions along z on both ends, balanced by twice that over the middle metre:
// two cantilevers, 10, 30 and 50 % of whose length the tips are deflected.
TEST(SlowNonlinearStatics, BentBar) {
  const Reduced body = reduce(box_mesh(Vec3(10, 1, 1), Vec3i(20, 2, 2)), 10, 20);
  Load load{face_load(
                body.mesh, [](const Vec3& x) { return std::abs(x.x()) > 5 - 1e-9; },
                [](const Vec3&) { return Vec3(0, 0, 1); }),
            0.5};
  load.forces += body_load(body.mesh, [](const Vec3& c, const Vec3&) {
    return Vec3(0, 0, std::abs(c.x()) < 0.5 ? -2.0 : 0.0);
  });
  // measured -1.5, -1.7, -2.2 %; another choice of points: +0.0, -0.2, -1.2 %
  compare("bar", body, load,
          {{0.0009899716622, 0.5, 3.11648e-06},
           {0.003217022722, 1.5, 3.67211e-05},
           {0.006474344305, 2.5, 0.000171534}},
          0.03, 0.01);
}

// A unit cube, drawn to its middle plane by the force density -4 z along z: its height falls by about
// 10 and 20 %. The displacement is the shortening in the weight of the load.
TEST(SlowNonlinearStatics, SquashedBlock) {
  const Reduced body = reduce(box_mesh(Vec3(1, 1, 1), Vec3i(4, 4, 4)), 10, 20);
  const Load load{
      body_load(body.mesh, [](const Vec3&, const Vec3& x) { return Vec3(0, 0, -4.0 * x.z()); }),
      2.0};
  // measured -3.0, -2.9 %
  compare("block", body, load,
          {{0.2805989386, 0.2 / 3, -0.0182814}, {0.6271951521, 0.4 / 3, -0.0394858}}, 0.05, 0.01);
}

/// The box of `size` (angle, radius, height) bent to a closed ring of mean radius 1 m.
TetMesh ring_mesh(double section, int around, int across) {
  using std::numbers::pi;
  TetMesh mesh = box_mesh(Vec3(2 * pi, section, section), Vec3i(around, across, across));
  const auto on_ring = [](const Vec3& x) {
    const double radius = 1.0 - x.y();
    return Vec3(radius * std::cos(x.x()), radius * std::sin(x.x()), x.z());
  };
  // the nodes at angle pi are those at -pi
  std::vector<int> place(mesh.nodes.size());
  std::vector<Vec3> nodes;
  for (std::size_t v = 0; v < mesh.nodes.size(); ++v) {
    if (mesh.nodes[v].x() > pi - 1e-9) continue;
    place[v] = int(nodes.size());
    nodes.push_back(on_ring(mesh.nodes[v]));
  }
  for (std::size_t v = 0; v < mesh.nodes.size(); ++v)
    if (mesh.nodes[v].x() > pi - 1e-9)
      for (std::size_t w = 0; w < mesh.nodes.size(); ++w)
        if ((mesh.nodes[w] + Vec3(2 * pi, 0, 0) - mesh.nodes[v]).norm() < 1e-9) place[v] = place[w];
  for (auto& tet : mesh.tets)
    for (int& node : tet) node = place[std::size_t(node)];
  for (auto& mids : mesh.mids)
    for (int& node : mids) node = place[std::size_t(node)];
  mesh.nodes = std::move(nodes);
  return mesh;
}

// A ring of mean radius 1 m and section 0.3 x 0.3 m, drawn together or apart along x by forces spread
// over the volumes within 15 degrees of the axis: 10 and 30 % of the mean diameter.
TEST(SlowNonlinearStatics, PinchedAndPulledRing) {
  using std::numbers::pi;
  const Reduced body = reduce(ring_mesh(0.3, 24, 2), 20, 20);
  const double volume = 0.09 * pi / 6;
  Load load{body_load(body.mesh,
                      [&](const Vec3& c, const Vec3&) {
                        const double angle = std::atan2(std::abs(c.y()), std::abs(c.x()));
                        return Vec3(angle < pi / 12 ? std::copysign(1.0 / volume, c.x()) : 0.0, 0,
                                    0);
                      }),
            1.0};
  // measured -3.6, -9.9 %: the basis is too stiff for a ring drawn straight
  compare("pulled ring", body, load,
          {{0.001028315358, 0.2, 0.000738583}, {0.004866350853, 0.6, 0.00375729}}, 0.12, 0.01);
  load.forces *= -1.0;  // measured -2.4, -3.6 %
  compare("pinched ring", body, load,
          {{0.0007762063501, 0.2, -0.000540402}, {0.001937871163, 0.6, -0.00133442}}, 0.05, 0.01);
}

// The soft ring of the scenes, under loads that its points were not chosen for. With kInvertedWeight
// = 1 it is 3.7 % off in the mean and 14.9 % at most.
TEST(SlowNonlinearStatics, PatchesOfARing) {
  const Recipe recipe = read_recipe(ARCHETIDE_ASSETS "/bodies/torus_nonlinear.body.toml");
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  Profile profile;
  const Archetype a = build_archetype(recipe, profile);
  const DeflectionError error =
      cubature_error(a.tets, recipe.material, a.node_modes, a.K_r, a.elastic);
  std::printf("ring: %d points, deflections %.2f %% off in the mean, %.2f %% at most\n",
              int(a.elastic.points()), 100 * error.mean, 100 * error.worst);
  EXPECT_LT(error.mean, 0.03);   // measured 0.019
  EXPECT_LT(error.worst, 0.12);  // measured 0.058
}

}  // namespace
}  // namespace archetide
