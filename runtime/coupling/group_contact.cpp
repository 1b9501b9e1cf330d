#include <chrono>

#include "runtime/coupling/coupling.h"
#include "runtime/coupling/stage_rows.h"

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr double kMayGive = 1e-3;  // cells a step that contacts may give way

}  // namespace

// The coupled solve with bodies that touch each other or are jointed. Joints are rows of the solve;
// so are the contacts that press and stick: which ones do is found by the contact solver, asked
// again with the water's impulses until its answer is that of the solve.
SolveReport Coupling::solve_together(Stage stage, double dt, const std::vector<StageBody>& bodies,
                                     GroupContacts& contacts, MacField& u,
                                     std::vector<CoupledBody>& coupled,
                                     std::vector<StageResult>& results) {
  const Clock::time_point start = Clock::now();
  const double h = stage == Stage::kPositionHalf ? 0.5 * dt : dt;
  StageRows rows(options_, dt, joints_, bodies, contacts, coupled, results, wet());
  std::vector<VecX> y_free(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) y_free[b] = coupled[b].y_star;
  rows.start_from_last_step(contacts, h);
  rows.resolve(y_free);
  contact_seconds_ = seconds_since(start);

  constexpr int kRounds = 4;
  const bool again = rows.contacts() > 0 && wet();
  const MacField u_star = again ? u : MacField();
  const std::vector<VecX> y_star = y_free;
  SolveReport total;
  for (int round = 1;; ++round) {
    rows.hold(wet());
    rows.start(y_star, coupled);
    const SolveReport r =
        solver_.solve(options_.grid, system_, h, coupled, options_.solve, u, valid_,
                      pressure_[stage == Stage::kVelocityFull], rows.held());
    total.add(r);
    for (std::size_t b = 0; b < bodies.size(); ++b)
      y_free[b] = y_star[b] + coupled[b].inverse_mass * coupled[b].impulse;
    rows.settle(y_free, coupled, results);
    if (!again || round == kRounds) break;
    const Clock::time_point asked = Clock::now();
    rows.resolve(y_free);
    const bool settled = rows.agrees(coupled, kMayGive * options_.grid.dx / dt);
    contact_seconds_ += seconds_since(asked);
    if (settled) break;
    u = u_star;
  }
  contacts.sweeps += rows.sweeps();
  contacts.forces = contact_forces(contacts.contacts, rows.system(), rows.impulses(), h);
  return total;
}

}  // namespace archetide
