#include <algorithm>
#include <chrono>

#include "runtime/coupling/coupling.h"

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr double kMayGive = 1e-3;  // cells a step that contacts may give way

/// Largest difference of relative speed at the contacts between two motions, m/s.
double largest_difference(const ContactSystem& system, const std::vector<VecX>& p,
                          const std::vector<VecX>& q) {
  double largest = 0.0;
  for (std::size_t k = 0; k < system.size(); ++k)
    largest = std::max(largest, (system.velocity(k, p) - system.velocity(k, q)).norm());
  return largest;
}

void add(const SolveReport& r, SolveReport& total) {
  total.iterations += r.iterations;
  total.residual = r.residual;
  total.converged = r.converged;
  total.setup_seconds += r.setup_seconds;
  total.solve_seconds += r.solve_seconds;
}

}  // namespace

// The coupled solve with bodies that touch each other.
SolveReport Coupling::solve_together(Stage stage, double dt, const std::vector<StageBody>& bodies,
                                     GroupContacts& contacts, MacField& u,
                                     std::vector<CoupledBody>& coupled,
                                     const std::vector<StageResult>& results) {
  const Clock::time_point start = Clock::now();
  const double h = stage == Stage::kPositionHalf ? 0.5 * dt : dt;
  std::vector<ConfigurationTerms> here(bodies.size());
  std::vector<ContactBody> masses(bodies.size());
  std::vector<VecX> y(bodies.size()), free_velocity(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = *bodies[b].body;
    here[b] = configuration_terms(body, current_configuration(body), options_.modal.mass);
    masses[b] = {&body, contacts.shapes[b], &here[b], &results[b].motion.H};
    y[b] = free_velocity[b] = coupled[b].y_star;
  }
  const ContactSystem system(contacts.contacts, masses);
  std::vector<Vec3> lambda = contact_impulses(contacts.contacts, system, contacts.start, h);
  contacts.sweeps += system.solve(contacts.target, contacts.solve, lambda, y).sweeps;
  contact_seconds_ = seconds_since(start);

  // Impulses first, then the water: it always has the last word, so that it agrees with the bodies.
  // Where its pressure carries points together again, more impulse, and once more: every round
  // leaves a / (1 + a) of the error, a the added mass over the mass.
  constexpr int kRounds = 4;
  const bool again = !contacts.contacts.empty() && wet();
  const MacField u_star = again ? u : MacField();
  SolveReport total;
  for (int round = 1;; ++round) {
    for (std::size_t b = 0; b < bodies.size(); ++b) coupled[b].y_star = y[b];
    const SolveReport r = solver_.solve(options_.grid, system_, h, coupled, options_.solve, u,
                                        valid_, pressure_[stage == Stage::kVelocityFull]);
    add(r, total);
    if (!again || round == kRounds) break;

    const Clock::time_point meeting = Clock::now();
    std::vector<VecX> with_water(bodies.size()), now(bodies.size());
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      with_water[b] = free_velocity[b] + coupled[b].inverse_mass * coupled[b].impulse;
      y[b] = with_water[b];
      now[b] = coupled[b].y;
    }
    contacts.sweeps += system.solve(contacts.target, contacts.solve, lambda, y).sweeps;
    const bool settled = largest_difference(system, y, now) * dt <= kMayGive * options_.grid.dx;
    for (std::size_t b = 0; b < bodies.size(); ++b) y[b] += free_velocity[b] - with_water[b];
    contact_seconds_ += seconds_since(meeting);
    if (settled) break;
    u = u_star;
  }
  contacts.forces = contact_forces(contacts.contacts, system, lambda, h);
  return total;
}

}  // namespace archetide
