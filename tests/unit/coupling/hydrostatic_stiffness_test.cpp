#include "runtime/coupling/hydrostatic_stiffness.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "runtime/coupling/coupling.h"
#include "runtime/coupling/hydrostatic_force.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/full_blob.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

/// Five modes with an elastic energy whose points have other volumes than the surface, which is a rung
/// that is drawn a tenth too far.
ReducedBody nonlinear_body() {
  static const std::shared_ptr<const Archetype> shape = [] {
    auto a = std::make_shared<Archetype>(*random_archetype(3, 5).archetype);
    std::srand(7);
    a->elastic = ElasticCubature(0.3 * MatX::Random(27, 5), VecX::Constant(3, 0.01),
                                 VecX::Constant(3, 1e4), VecX::Constant(3, 1e4));
    a->ladder = {SurfaceRung{a->surface, 1.1 * a->surface_modes, 0.0}};
    derive_shapes(*a);
    return a;
  }();
  ReducedBody body = make_body(shape, 5);
  body.rung = &shape->ladder[0];
  return body;
}

/// A soft body, turned, in water of 0.8 m whose cells are a sixteenth of a metre.
struct StillTank {
  CoupledTank tank{Grid{16, 16, 16, 1.0 / 16, Vec3::Zero()}};
  Coupling coupling;
  ReducedBody& body;

  explicit StillTank(double height, const ReducedBody& of = nonlinear_body())
      : coupling(made(height, of, tank), {}), body(tank.bodies[0]) {
    coupling.couple(Stage::kVelocityFull, 1e-3, {&tank.phi},
                    {{&body, current_configuration(body), {}, false, {}, {}, {}}}, tank.u,
                    tank.results);
  }

  static const CouplingOptions& made(double height, ReducedBody body, CoupledTank& tank) {
    tank.options.open_side = {false, false, false, false, false, true};
    tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
    tank.options.hydrostatics.reference = Vec3(0, 0, 0.8);
    for (int k = 0; k < 16; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i) tank.phi(i, j, k) = (k + 0.5) / 16 - 0.8;
    body.position = Vec3(0.5, 0.5, height);
    body.rotation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()));
    tank.bodies = {body};
    return tank.options;
  }
  BodySurface surface(const VecX& q) {
    body.q = q;
    return body_surface(body, ModalMass::kExact);
  }
  /// -d f_q / dq by central differences, pressure read at the moved surface or where it was.
  MatX differences(bool read_moved) {
    constexpr double kStep = 1e-5;
    const std::vector<Vec3> rest = surface(VecX::Zero(5)).points;
    MatX K(5, 5);
    for (int j = 0; j < 5; ++j) {
      VecX force[2];
      for (const int side : {0, 1}) {
        const BodySurface s = surface((side ? kStep : -kStep) * VecX::Unit(5, j));
        force[side] =
            hydrostatic_force(tank.options.grid, s, read_moved ? s.points : rest, coupling.system())
                .tail(5);
      }
      K.col(j) = (force[0] - force[1]) / (2.0 * kStep);
    }
    surface(VecX::Zero(5));
    return K;
  }
  HydrostaticStiffness stiffness() {
    return hydrostatic_stiffness(tank.options.grid, surface(VecX::Zero(5)), coupling.system());
  }
};

// All of it under water: exact but for the differences, and symmetric as the pressure has a
// potential.
TEST(HydrostaticStiffness, IsTheDerivativeOfTheForce) {
  StillTank tank(0.4);
  const HydrostaticStiffness K = tank.stiffness();
  const MatX whole = tank.differences(true), of_normals = tank.differences(false);
  const double scale = whole.norm();
  std::printf("measured: %.1e, of the normals %.1e, asymmetry %.1e of %.1e N m\n",
              (K.whole.modes - whole).norm() / scale,
              (K.of_normals.modes - of_normals).norm() / scale,
              (whole - whole.transpose()).norm() / scale, scale);
  EXPECT_LT((K.whole.modes - whole).norm(), 1e-10 * scale);
  EXPECT_LT((K.of_normals.modes - of_normals).norm(), 1e-10 * scale);
}

// Afloat the pressure is counted by vertices: it is the tangent of an implicit step, no more.
TEST(HydrostaticStiffness, IsNearTheDerivativeAfloat) {
  StillTank tank(0.75);
  const MatX whole = tank.differences(true);
  const double off = (tank.stiffness().whole.modes - whole).norm() / whole.norm();
  std::printf("measured: %.2f\n", off);
  EXPECT_LT(off, 0.3);
}

// A level set that is not a distance has the same interface: beside bodies that move its slope changes
// [D96].
TEST(HydrostaticForce, IsThatOfTheInterfaceHoweverSteepPhiIs) {
  StillTank tank(0.75);
  const BodySurface s = tank.surface(VecX::Zero(5));
  const auto force = [&] {
    return hydrostatic_force(tank.tank.options.grid, s, s.points, tank.coupling.system());
  };
  const VecX as_distance = force();
  for (const double steepness : {0.7, 1.4}) {
    Array3<double>& phi = tank.tank.phi;
    for (std::size_t n = 0; n < phi.size(); ++n) phi[n] *= steepness;
    EXPECT_LT((force() - as_distance).norm(), 1e-12 * as_distance.norm());
    for (std::size_t n = 0; n < phi.size(); ++n) phi[n] /= steepness;
  }
}

// Of a bent body of nodes: that of all its modes. Measured: 3e-14.
TEST(HydrostaticStiffness, OfNodesIsThatOfAllModes) {
  const std::shared_ptr<const FullBlob> blob = nonlinear_blob();
  const MatX& S = blob->archetype->node_modes;
  VecX q = VecX::Zero(S.cols());
  q.head<4>() << 0.35, -0.2, 0.15, 0.1;
  const auto stiffness = [&](ReducedBody body, const VecX& shape) {
    body.q = shape;
    StillTank tank(0.5, body);
    return hydrostatic_stiffness(tank.tank.options.grid, tank.surface(shape),
                                 tank.coupling.system());
  };
  const HydrostaticStiffness modal = stiffness(body_of_modes(*blob), q),
                             nodal = stiffness(body_of_nodes(*blob), S * q);
  std::srand(8);
  const VecX along = VecX::Random(S.cols());
  for (const auto part : {&HydrostaticStiffness::whole, &HydrostaticStiffness::of_normals}) {
    const VecX wanted = (modal.*part) * along;
    EXPECT_LT((S.transpose() * ((nodal.*part) * (S * along)) - wanted).norm(),
              1e-12 * wanted.norm());
  }
}

TEST(HydrostaticStiffness, IsNoneAboveTheWater) {
  StillTank tank(1.3);
  EXPECT_EQ(tank.stiffness().whole.modes.norm(), 0.0);
}

}  // namespace
}  // namespace archetide
