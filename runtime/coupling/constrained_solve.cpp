#include <algorithm>

#include "runtime/coupling/coupling.h"
#include "runtime/coupling/stage_constraints.h"
#include "runtime/cut_cells/flux_columns.h"
#include "runtime/numerics/parallel.h"
#include "runtime/numerics/solve_report.h"

namespace archetide {
namespace {

// Of the first solve where contacts may press: it only has to tell which ones do.
constexpr double kTrialTolerance = 1e-2;
constexpr double kExact = 1e-6;  // tolerance of solves from which on contacts are exact as well
/// Cells a step that contacts may give way.
double may_give(double tolerance) { return std::clamp(1e3 * tolerance, 1e3 * kExact, 1e-2); }

bool may_touch(const GroupContacts& contacts, const std::vector<StageResult>& results) {
  if (!contacts.shapes.empty()) return !contacts.contacts.empty();
  return std::any_of(results.begin(), results.end(),
                     [](const StageResult& body) { return !body.contacts.points.empty(); });
}

// Generalised impulse on a body of nodes of its first guess of the pressure.
VecX push_of_water(const CoupledOperator::Body& body, double mean_push, double mass,
                   const Array3<double>& pressure) {
  VecX p(static_cast<Eigen::Index>(body.cell.size()));
  for (std::size_t m = 0; m < body.cell.size(); ++m)
    p[static_cast<Eigen::Index>(m)] =
        mean_push + mass * pressure[static_cast<std::size_t>(body.cell[m])];
  return body.nodes->surface().to_body(body.gather(p));
}

}  // namespace

// How the bodies answer impulses once the water does, (H + M)^-1 with M their added mass in the
// system that is about to be solved; and `y` with the push that the water had in its first guess.
// Eq. C17a.
std::vector<MatX> Coupling::wet_inverses(Stage stage, double h,
                                         const std::vector<CoupledBody>& coupled,
                                         std::vector<VecX>& y) const {
  const Grid& g = options_.grid;
  const double rho = options_.hydrostatics.density, mass = rho * g.dx * g.dx * g.dx;
  const double mean_push = h * rho * system_.surface_mean * g.dx * g.dx;
  const Array3<double>& pressure = pressure_[stage == Stage::kVelocityFull];
  std::vector<MatX> inverse(coupled.size());
  for_each_large(coupled.size(), [&](std::size_t b) {
    const CoupledOperator::Body body = CoupledOperator::body_of(g, system_, rho, coupled[b]);
    const MatX &H = body.inverse_mass, &M = body.added_mass;
    if (body.nodes) {
      inverse[b] = mass * M * (MatX::Identity(M.rows(), M.cols()) + H * M).inverse();
      inverse[b] = 0.5 * (inverse[b] + inverse[b].transpose()).eval();
      y[b] -= coupled[b].answer(push_of_water(body, mean_push, mass, pressure));
      return;
    }
    inverse[b] = H * (MatX::Identity(M.rows(), M.cols()) + M * H).inverse() / mass;
    y[b] -=
        coupled[b].inverse_mass * (mean_push * sum_columns(body.flux) +
                                   mass * gather_columns(body.flux, body.cell, pressure.data()));
  });
  return inverse;
}

// The coupled solve with bodies that touch each other or walls, or are jointed. Joints are rows of the solve;
// so are the contacts that press and stick: which ones do is found by the contact solver on bodies
// with their added mass, and confirmed with the velocities of the solve.
SolveReport Coupling::solve_together(Stage stage, double dt, const std::vector<StageBody>& bodies,
                                     GroupContacts& contacts, MacField& u,
                                     std::vector<CoupledBody>& coupled,
                                     std::vector<StageResult>& results) {
  const Stopwatch watch;
  const double h = stage_seconds(stage, dt);
  std::vector<VecX> y_star(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) y_star[b] = coupled[b].y_star;
  std::vector<VecX> y_free = y_star;
  const bool again = wet() && may_touch(contacts, results);
  std::vector<MatX> wet_inverse;
  if (again) wet_inverse = wet_inverses(stage, h, coupled, y_free);
  StageConstraints rows(options_, dt, joints_, bodies, contacts, coupled, results,
                        std::move(wet_inverse));
  rows.start_from_last_step(contacts, h);
  rows.resolve(again ? rows.expected_free(y_free) : rows.at_rows(y_free));
  contact_seconds_ = watch.wall();

  // All but the last solve only have to tell which contacts press and at what speeds; the last two
  // have the scene's tolerance if that is an exact one.
  constexpr int kRounds = 6;
  const double give = may_give(options_.solve.tolerance), middle = 0.1 * give;
  const int last_rounds = options_.solve.tolerance < kExact ? 2 : 1;
  CoupledSolveOptions solve = options_.solve;
  const auto loosen = [&](double tolerance) {
    solve.tolerance = std::max(options_.solve.tolerance, again ? tolerance : 0.0);
  };
  loosen(kTrialTolerance);
  Array3<double>& pressure = pressure_[stage == Stage::kVelocityFull];
  SolveReport total;
  for (int round = 1, at_tolerance = 0;; ++round) {
    rows.hold();
    rows.start(y_star, coupled);
    total.add(solver_.find_pressure(options_.grid, system_, h, coupled, solve, u, pressure,
                                    rows.held(), round > 1));
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (coupled[b].nodes)
        y_free[b] = y_star[b] + coupled[b].answer(coupled[b].impulse);
      else
        y_free[b] = y_star[b] + coupled[b].inverse_mass * coupled[b].impulse;
    rows.settle(y_free, coupled, results);
    if (!again || round == kRounds) break;
    const Stopwatch round_watch;
    rows.resolve(rows.free_of_rows(coupled));
    const bool settled = rows.agrees(coupled, give * options_.grid.dx / dt);
    contact_seconds_ += round_watch.wall();
    at_tolerance = solve.tolerance == options_.solve.tolerance ? at_tolerance + 1 : 0;
    if (settled && at_tolerance >= last_rounds) break;
    const bool ending = settled || round + last_rounds >= kRounds ||
                        (at_tolerance > 0 && at_tolerance < last_rounds);
    loosen(ending ? 0.0 : middle);
  }
  solver_.move_water(options_.grid, system_, h, pressure, u, valid_);
  contacts.sweeps += rows.sweeps();
  contacts.forces = contact_forces(contacts.contacts, rows.system(), rows.impulses(), h);
  return total;
}

}  // namespace archetide
