#include <chrono>

#include "runtime/coupling/coupling.h"

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
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
  std::vector<VecX> y(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = *bodies[b].body;
    here[b] = configuration_terms(body, current_configuration(body), options_.modal.mass);
    masses[b] = {&body, contacts.shapes[b], &here[b], &results[b].motion.H};
    y[b] = coupled[b].y_star;
  }
  const ContactSystem system(contacts.contacts, masses);
  std::vector<Vec3> lambda = contact_impulses(contacts.contacts, system, contacts.start, h);
  contacts.sweeps += system.solve(contacts.target, contacts.solve, lambda, y).sweeps;
  contact_seconds_ = seconds_since(start);

  SolveReport report;
  for (std::size_t b = 0; b < bodies.size(); ++b) coupled[b].y_star = y[b];
  report = solver_.solve(options_.grid, system_, h, coupled, options_.solve, u, valid_,
                         pressure_[stage == Stage::kVelocityFull]);
  contacts.forces = contact_forces(contacts.contacts, system, lambda, h);
  return report;
}

}  // namespace archetide
