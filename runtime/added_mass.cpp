#include "runtime/added_mass.h"

#include <Eigen/Dense>

#include "common/base/input_error.h"

namespace archetide {
namespace {

// Short, so that elasticity does not resist: the mass of the bodies in the solve is that of an
// impulse.
constexpr double kSeconds = 1e-6;
// Of a motion, what water that cannot follow leaves of it: a million times its own mass holds it.
constexpr double kLeastMotion = 1e-6;

CouplingOptions options_of(const AddedMassTank& tank) {
  CouplingOptions o;
  o.grid = tank.grid;
  o.has_water = true;
  o.open_side.fill(!tank.walls);
  if (std::isfinite(tank.level)) o.open_side[kZMax] = true;
  o.hydrostatics = {tank.density, Vec3::Zero(), Vec3::Zero()};
  o.solve.tolerance = tank.tolerance;
  return o;
}

// Depth of the surface below each cell's centre, m.
Array3<double> still_water(const AddedMassTank& tank) {
  const Grid& g = tank.grid;
  const double full = g.dx * (g.nx + g.ny + g.nz);
  Array3<double> phi(g.nx, g.ny, g.nz, -full);
  if (!std::isfinite(tank.level)) return phi;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) phi(i, j, k) = g.cell_centre(i, j, k)[2] - tank.level;
  return phi;
}

void require_inside(const ReducedBody& body, const Grid& g) {
  std::vector<Vec3> points;
  surface_points(body, points);
  for (const Vec3& x : points)
    if ((x.array() < g.low().array()).any() || (x.array() > g.high().array()).any())
      throw InputError("the body leaves the tank", "make the tank larger, or move the body");
}

// Momenta and rates of the unit velocity i of (v, w, q_dot).
void set_unit_velocity(const ConfigurationTerms& terms, Eigen::Index i, ReducedBody& body) {
  const VecX y = VecX::Unit(body.dofs(), i);
  body.P = terms.mass * y.head<3>();
  body.L = terms.inertia * y.segment<3>(3);
  body.q_dot = y.tail(body.r);
}

}  // namespace

Grid added_mass_grid(double cell, const Vec3& size) {
  const auto even = [&](double length) {
    const double half = std::ceil(0.5 * length / cell - 1e-9);
    if (!(half < 1e4))
      throw InputError("the tank has more cells than a machine can hold along a side",
                       "ask for larger cells or a smaller tank");
    return 2 * std::max(1, static_cast<int>(half));
  };
  Grid g{even(size[0]), even(size[1]), even(size[2]), cell, Vec3::Zero()};
  g.origin = -0.5 * cell * Vec3(g.nx, g.ny, g.nz);
  return g;
}

// Eq. B7.
AddedMass added_mass(const ReducedBody& at_rest, const AddedMassTank& tank) {
  require_inside(at_rest, tank.grid);
  ReducedBody body = at_rest;
  body.mass_scale = tank.density / body.archetype->density;  // as heavy as water: well conditioned
  const Configuration at = current_configuration(body);
  const ConfigurationTerms terms = configuration_terms(body, at, ModalMass::kExact);
  const Array3<double> phi = still_water(tank);
  Coupling coupling(options_of(tank), {});
  const Eigen::Index n = body.dofs();
  MatX velocities(n, n), impulses(n, n);
  AddedMass found;
  for (Eigen::Index i = 0; i < n; ++i) {
    set_unit_velocity(terms, i, body);
    MacField u(tank.grid, 0.0);
    std::vector<StageResult> results;
    coupling.forget_guess(Stage::kVelocityFull);
    const SolveReport report = coupling.couple(Stage::kVelocityFull, kSeconds, {&phi},
                                               {{&body, at, {}, false, {}}}, u, results);
    if (!report.converged)
      throw NumericsError("the solve for motion " + std::to_string(i + 1) + " did not converge");
    found.iterations += report.iterations;
    velocities.col(i) = results[0].y;
    impulses.col(i) = -results[0].water_impulse;
  }
  if (impulses.isZero(0.0)) throw InputError("no water meets the body", "raise the level");
  // Of the scaled velocities sqrt(H_ii) y_i.
  const VecX units = generalised_mass(body, terms, 0.0, Stage::kVelocityFull, ModalStep::kTrapezoid)
                         .dense()
                         .diagonal()
                         .cwiseSqrt();
  Eigen::FullPivLU<MatX> factor;
  factor.setThreshold(kLeastMotion);
  factor.compute((units.asDiagonal() * velocities * units.cwiseInverse().asDiagonal()).transpose());
  if (!factor.isInvertible())
    throw NumericsError("walls around water without a surface keep the body from " +
                        std::to_string(n - factor.rank()) + " of its motions: open the sides");
  const MatX scaled =
      units.cwiseInverse().asDiagonal() * impulses * units.cwiseInverse().asDiagonal();
  const MatX matrix =
      units.asDiagonal() * factor.solve(scaled.transpose()).transpose() * units.asDiagonal();
  const VecX scale = matrix.diagonal().cwiseAbs().cwiseSqrt().cwiseMax(1e-300);
  found.asymmetry =
      (scale.asDiagonal().inverse() * (matrix - matrix.transpose()) * scale.asDiagonal().inverse())
          .cwiseAbs()
          .maxCoeff();
  found.matrix = 0.5 * (matrix + matrix.transpose());
  return found;
}

}  // namespace archetide
