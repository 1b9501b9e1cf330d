// Hard case H19: no modes, one, and all of them.
#include "common/archetype/complete_basis.h"
#include "tests/hard/hard_case.h"
#include "tests/support/small_fem.h"

namespace archetide {
namespace {

constexpr double kYoung = 2e4, kPoisson = 0.3, kDensity = 1000.0;

/// A body with every motion of a small mesh (r = 3n - 6), and the same in nodal coordinates.
struct FullBody {
  SmallFem fem;
  std::shared_ptr<Archetype> archetype;
};

FullBody full_body(double beta) {
  TetMesh mesh = blob_tets(9, Vec3(0.5, 0.4, 0.3), Vec3i(2, 2, 1));
  FullBody body{small_fem(mesh, kDensity, kYoung, kPoisson), nullptr};
  const ElasticModes all = elastic_modes(body.fem);
  body.archetype = deformable_archetype(mesh, kDensity, all.shapes, all.omega).archetype;
  body.fem.beta = body.archetype->beta = beta;
  return body;
}

/// Displacement of every node from rest while the body has moved by no more than round-off can
/// tell from linear: t + theta x y + S q, 3n.
VecX displacement(const ReducedBody& body) {
  const Archetype& a = *body.archetype;
  VecX u = a.node_modes * body.q;
  const Vec3 theta = 2.0 * body.rotation.vec();
  for (std::size_t v = 0; v < a.tets.nodes.size(); ++v)
    u.segment<3>(3 * static_cast<Eigen::Index>(v)) += body.position + theta.cross(a.tets.nodes[v]);
  return u;
}

/// v + w x y + (S - (I^-1 D) x y) q_dot at every node, at rest, 3n.
VecX velocity(const ReducedBody& body) {
  const Archetype& a = *body.archetype;
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  VecX u_dot = a.node_modes * body.q_dot;
  const Vec3 spin = frame_spin(terms, body.L, body.q_dot);
  for (std::size_t v = 0; v < a.tets.nodes.size(); ++v)
    u_dot.segment<3>(3 * static_cast<Eigen::Index>(v)) +=
        body.P / terms.mass + spin.cross(a.tets.nodes[v]);
  return u_dot;
}

/// (sum f, sum y x f, B^T f) of the rest shape, 6 + r; its D is zero but for round-off.
VecX generalised(const ReducedBody& body, const VecX& f) {
  const Archetype& a = *body.archetype;
  VecX force(body.dofs());
  force.setZero();
  for (std::size_t v = 0; v < a.tets.nodes.size(); ++v) {
    const Vec3 part = f.segment<3>(3 * static_cast<Eigen::Index>(v));
    force.head<3>() += part;
    force.segment<3>(3) += a.tets.nodes[v].cross(part);
  }
  force.tail(body.r) = a.node_modes.transpose() * f;
  return force;
}

// The same trapezoidal rule in nodal coordinates and in all modes: free vibration, then a load that
// also pushes and turns the body, with damping. Displacements of 1e-9 of the size, so that what is
// of second order in them (rotation of the frame, modal mass) is below round-off's share.
TEST(H19AllModes, AreTheFiniteElementModel) {
  constexpr double kDt = 0.01, kSmall = 1e-9;
  for (const double beta : {0.0, 0.002}) {
    const FullBody full = full_body(beta);
    ASSERT_TRUE(has_complete_basis(*full.archetype));
    ReducedBody body = make_body(full.archetype, full.archetype->r());
    const Eigen::Index n3 = full.fem.K.rows();
    std::srand(5);
    const VecX start = kSmall * VecX::Random(n3), load = 20.0 * kSmall * VecX::Random(n3);
    // the motion of the start without its rigid part
    body.q_dot = full.archetype->node_modes.transpose() * (full.fem.mass() * start);
    NodalState nodal{VecX::Zero(n3), full.archetype->node_modes * body.q_dot};
    const NodalStepper stepper(full.fem, kDt);
    double apart = 0.0, largest = 0.0, speed_apart = 0.0, fastest = 0.0;
    for (int n = 0; n < 200; ++n) {
      const VecX f = n < 100 ? VecX(VecX::Zero(n3)) : load;
      dry_step(body, generalised(body, f), kDt, {});
      stepper.step(f, nodal);
      apart = std::max(apart, (displacement(body) - nodal.u).lpNorm<Eigen::Infinity>());
      speed_apart = std::max(speed_apart, (velocity(body) - nodal.u_dot).lpNorm<Eigen::Infinity>());
      largest = std::max(largest, nodal.u.lpNorm<Eigen::Infinity>());
      fastest = std::max(fastest, nodal.u_dot.lpNorm<Eigen::Infinity>());
    }
    std::printf("%d modes, largest displacement %.2e m\n", body.r, largest);
    expect_at_most("displacement, all modes against the nodes", apart / largest, 1e-8);
    expect_at_most("velocity, all modes against the nodes", speed_apart / fastest, 1e-8);
  }
}

// Fewer modes are another model: what the equality above is worth.
TEST(H19AllModes, HalfOfThemAreNot) {
  constexpr double kDt = 0.01;
  const FullBody full = full_body(0.0);
  ReducedBody body = make_body(full.archetype, full.archetype->r() / 2);
  const Eigen::Index n3 = full.fem.K.rows();
  const VecX f = 1e-9 * VecX::Unit(n3, 4);
  VecX force = VecX::Zero(body.dofs());
  force.head<3>() = Vec3(0, 1e-9, 0);
  force.segment<3>(3) = full.archetype->tets.nodes[1].cross(Vec3(0, 1e-9, 0));
  force.tail(body.r) = full.archetype->node_modes.leftCols(body.r).transpose() * f;
  NodalState nodal{VecX::Zero(n3), VecX::Zero(n3)};
  const NodalStepper stepper(full.fem, kDt);
  for (int n = 0; n < 20; ++n) dry_step(body, force, kDt, {}), stepper.step(f, nodal);
  VecX u = full.archetype->node_modes.leftCols(body.r) * body.q;
  EXPECT_GT((u - full.archetype->node_modes *
                     (full.archetype->node_modes.transpose() * (full.fem.mass() * nodal.u)))
                .norm(),
            1e-3 * u.norm());
}

/// Positions and momenta of one body after 20 steps in water.
ReducedBody swum(std::shared_ptr<const Archetype> archetype, int r) {
  ReducedBody body = make_body(std::move(archetype), r);
  body.mass_scale = 0.7;
  body.position = Vec3(0.5, 0.52, 0.45);
  body.P = Vec3(2.0, -1.0, 3.0);
  body.L = Vec3(0.1, 0.2, -0.1);
  SimulationOptions o = unit_tank(12);
  Simulation s(o, water_to(o.grid, 0.6), {body}, {});
  run_to(s, 0.2, 0.01);
  return s.bodies()[0];
}

// A body that uses none of its archetype's modes is one that has none, to the last bit.
TEST(H19NoModes, AreTheRigidBodyBitForBit) {
  const auto soft = random_archetype(4, 6).archetype;
  auto rigid = std::make_shared<Archetype>(*soft);
  rigid->omega2.resize(0), rigid->residuals.resize(0), rigid->is_static.clear();
  rigid->surface_modes.resize(rigid->surface_modes.rows(), 0);
  rigid->node_modes.resize(rigid->node_modes.rows(), 0);
  rigid->M_r.resize(0, 0), rigid->K_r.resize(0, 0);
  rigid->integrals.I3.clear(), rigid->integrals.A.clear(), rigid->integrals.B.clear();
  rigid->linear = {};
  const ReducedBody a = swum(soft, 0), b = swum(rigid, 0);
  EXPECT_TRUE(a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs() &&
              a.P == b.P && a.L == b.L);
  expect_at_most("rigid against r = 0", (a.position - b.position).norm(), 0.0);
}

// One mode: the first column of everything, whatever else is stored.
TEST(H19OneMode, DoesNotSeeTheOthersThatAreStored) {
  const auto many = random_archetype(4, 6).archetype;
  auto one = std::make_shared<Archetype>(*many);
  one->omega2.conservativeResize(1), one->residuals.conservativeResize(1);
  one->is_static.resize(1);
  one->surface_modes.conservativeResize(Eigen::NoChange, 1);
  one->node_modes.conservativeResize(Eigen::NoChange, 1);
  one->M_r.conservativeResize(1, 1), one->K_r.conservativeResize(1, 1);
  one->integrals.I3.resize(1), one->integrals.A.resize(1), one->integrals.B.resize(1);
  derive_shapes(*one);
  const ReducedBody a = swum(many, 1), b = swum(one, 1);
  EXPECT_TRUE(a.position == b.position && a.q == b.q && a.q_dot == b.q_dot && a.L == b.L);
}

}  // namespace
}  // namespace archetide
