#include <algorithm>
#include <chrono>

#include "runtime/coupling/coupling.h"

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr double kMayApproach = 0.02;  // cells a step that contacts may give way

/// Speed by which the worst contact misses its target, m/s.
double largest_approach(const ContactSystem& system, const VecX& target,
                        const std::vector<CoupledBody>& bodies) {
  std::vector<VecX> y;
  for (const CoupledBody& b : bodies) y.push_back(b.y);
  double largest = 0.0;
  for (std::size_t k = 0; k < system.size(); ++k)
    largest = std::max(largest, target[static_cast<long>(k)] - system.velocity(k, y)[0]);
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
  constexpr int kRounds = 3;
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
    const double approach = largest_approach(system, contacts.target, coupled);
    const bool apart = approach * dt <= kMayApproach * options_.grid.dx;
    if (!apart) {
      for (std::size_t b = 0; b < bodies.size(); ++b)
        y[b] = free_velocity[b] + coupled[b].inverse_mass * coupled[b].impulse;
      const std::vector<VecX> with_water = y;
      contacts.sweeps += system.solve(contacts.target, contacts.solve, lambda, y).sweeps;
      for (std::size_t b = 0; b < bodies.size(); ++b) y[b] += free_velocity[b] - with_water[b];
    }
    contact_seconds_ += seconds_since(meeting);
    if (apart) break;
    u = u_star;
  }
  contacts.forces = contact_forces(contacts.contacts, system, lambda, h);
  return total;
}

}  // namespace archetide
