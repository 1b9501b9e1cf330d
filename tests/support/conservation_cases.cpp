#include "tests/support/conservation_cases.h"

#include <algorithm>
#include <cmath>

#include "tests/support/constants.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

double energy_of(const StepReport& r) {
  return r.water_kinetic + r.body_kinetic + r.body_elastic + r.spray_kinetic;
}

SimulationOptions weightless_tank(int n) {
  SimulationOptions o;
  o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.gravity = Vec3::Zero();
  return o;
}

// The first step is the start: sums of water exist from then on.
ConservationResult watch(Simulation& s, double end) {
  ConservationResult result;
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();
  double energy = 0.0;
  StepReport r;
  while (s.time() < end - 1e-9) {
    r = s.step(std::min(s.stable_dt(), end - s.time()));
    const Vec3 here = r.water_momentum + r.body_momentum + r.spray_momentum,
               turn = r.water_angular_momentum + r.body_angular_momentum;
    if (result.steps++ == 0) P = here, L = turn, energy = energy_of(r);
    result.momentum = std::max(result.momentum, (here - P).norm() / P.norm());
    result.angular_momentum = std::max(result.angular_momentum, (turn - L).norm() / L.norm());
    result.iterations = std::max({result.iterations, r.position.iterations, r.velocity.iterations});
  }
  result.energy = energy_of(r) / energy;
  result.transport = r.budget.transported.kinetic / energy;
  return result;
}

// A cube of tets drawn in to a ball.
TetMesh ball_tets(double radius, int cells) {
  TetMesh mesh = box_tets(Vec3::Constant(2.0 * radius), Vec3i::Constant(cells));
  for (Vec3& x : mesh.nodes)
    if (x.norm() > 0.0) x *= x.cwiseAbs().maxCoeff() / x.norm();
  return mesh;
}

// A ring of tets with its square tube drawn in to a round one.
TetMesh ring_tets(double R, double r, int around, int across) {
  TetMesh mesh = torus_tets(R, r, around, across);
  for (Vec3& x : mesh.nodes) {
    const Vec3 out = Vec3(x[0], x[1], 0.0).normalized();
    const Eigen::Vector2d at(x.dot(out) - R, x[2]);
    if (at.norm() == 0.0) continue;
    const Eigen::Vector2d drawn = at * at.cwiseAbs().maxCoeff() / at.norm();
    x = (R + drawn[0]) * out + drawn[1] * Vec3::UnitZ();
  }
  return mesh;
}

// A body of one mode of this shape and frequency.
template <class Shape>
ReducedBody one_mode(const TetMesh& tets, double density, double omega, const Shape& shape) {
  MatX shapes(3 * static_cast<Eigen::Index>(tets.nodes.size()), 1);
  for (std::size_t n = 0; n < tets.nodes.size(); ++n)
    shapes.block<3, 1>(3 * static_cast<Eigen::Index>(n), 0) = shape(tets.nodes[n]);
  return make_body(deformable_archetype(tets, density, shapes, VecX::Constant(1, omega)).archetype,
                   1);
}

// So much, m, of its mode's largest displacement.
void bend(double by, ReducedBody& body) {
  body.q[0] = by / body.archetype->surface_modes.cwiseAbs().maxCoeff();
}

}  // namespace

ConservationResult drifting_blob(int n) {
  constexpr double kBlob = 0.35, kBall = 0.14, kStiffness = 20.0;  // m, m, rad/s
  SimulationOptions o = weightless_tank(n);
  o.open_side.fill(true);
  o.max_dt = 0.02;
  const Vec3 centre(0.45, 0.48, 0.5), drift(0.12, 0.06, 0.0), spin(0.2, -0.3, 0.4);
  ReducedBody ball = one_mode(ball_tets(kBall, 8), 0.7 * kWaterDensity, kStiffness,
                              [](const Vec3& x) { return Vec3(x[0], -0.5 * x[1], -0.5 * x[2]); });
  ball.position = centre + Vec3(0.05, -0.02, 0.03);
  const Vec3 v = drift + spin.cross(ball.position - centre);
  ball.P = body_mass(ball) * v;
  ball.L = configuration_terms(ball, current_configuration(ball), ModalMass::kExact).inertia * spin;
  bend(0.1 * kBall, ball);
  FluidState water =
      water_where(o.grid, [&](const Vec3& x) { return (x - centre).norm() - kBlob; });
  set_velocity(
      o.grid, [&](const Vec3& x) -> Vec3 { return drift + spin.cross(x - centre); }, water);
  Simulation s(o, water, {ball}, {});
  return watch(s, 1.0);
}

ConservationResult ringing_ring(int n, double bent) {
  SimulationOptions o = weightless_tank(n);
  o.max_dt = 0.02;
  ReducedBody ring = one_mode(
      ring_tets(0.25, 0.08, 40, 6), 0.5 * kWaterDensity, 20.0, [](const Vec3& x) {  // folds
        const double about = std::atan2(x[1], x[0]);
        return Vec3(0.0, 0.0, x.head<2>().squaredNorm() * std::cos(2.0 * about));
      });
  ring.position = Vec3(0.5, 0.49, 0.51);
  bend(bent, ring);
  Simulation s(o, water_to(o.grid, INFINITY), {ring}, {});
  return watch(s, 1.0);
}

}  // namespace archetide
