#include "runtime/thrown_bodies.h"

#include "runtime/statistics.h"

namespace archetide {

namespace {

double energy_with_potential(const SimulationState& s, const std::vector<ReducedBody>& bodies) {
  double energy = energy_of_bodies(bodies);
  for (const ReducedBody& body : bodies)
    energy -= body_mass(body) * s.options.gravity.dot(body.position);
  return energy;
}

// Bodies that touch nothing but each other, obstacles and walls. What they may seem to gain: the error
// of a step, and what lifts those that overlap by `overlap` (m) out of each other.
bool thrown_by_contact(const SimulationState& s, const std::vector<ReducedBody>& before,
                       double overlap, double dt) {
  constexpr double kError = 1e-3;
  const double g = s.options.gravity.norm();
  double possible = kError * energy_of_bodies(before);
  for (std::size_t b = 0; b < before.size(); ++b) {
    const double way = recovery_speed(overlap, dt, g) * dt;
    possible += body_mass(before[b]) * g * (way + kError * s.reach[b].rest);
  }
  return energy_with_potential(s, s.bodies) - energy_with_potential(s, before) > possible;
}

}  // namespace

bool bodies_are_thrown(const SimulationState& s, const std::vector<ReducedBody>& before,
                       const StepReport& report, bool dry, double dt) {
  if (!s.actuators.empty()) return false;
  if (dry && report.contacts > 0 && thrown_by_contact(s, before, report.max_penetration, dt))
    return true;
  constexpr double kOfWater = 0.1, kWays = 2.0;
  const double g = s.options.gravity.norm();
  const double first = energy_of_bodies(before);
  double possible = first + kOfWater * s.budget.last_motion().kinetic;
  for (const ReducedBody& body : before) {
    const double way = body.last_way.size() > 0 ? body.last_way.head<3>().norm() * dt : 0.0;
    const double mass = body_mass(body) + s.options.water_density * body.archetype->volume;
    possible += kWays * mass * g * (way + g * dt * dt);
  }
  return energy_of_bodies(s.bodies) - first > possible;
}

}  // namespace archetide
