#include "runtime/thrown_bodies.h"

#include "runtime/statistics.h"

namespace archetide {
namespace {

// Potential energy that the bodies have gained on their way, J.
double lifted(const SimulationState& s, const std::vector<ReducedBody>& before) {
  double energy = 0.0;
  for (std::size_t b = 0; b < before.size(); ++b)
    energy -=
        body_mass(before[b]) * s.options.gravity.dot(s.bodies[b].position - before[b].position);
  return energy;
}

// What bodies of energy `first` (J) that touch nothing but each other, obstacles and walls may seem to
// gain: the error of a step, and what lifts those that overlap by `overlap` (m) out of each other.
double gain_by_contact(const SimulationState& s, double first, double overlap, double dt) {
  constexpr double kError = 1e-3;
  const double g = s.options.gravity.norm(), way = recovery_speed(overlap, dt, g) * dt;
  double gain = kError * first;
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    gain += body_mass(s.bodies[b]) * g * (way + kError * s.reach[b].rest);
  return gain;
}

}  // namespace

bool bodies_are_thrown(const SimulationState& s, const std::vector<ReducedBody>& before,
                       const StepReport& report, bool dry, double dt) {
  if (!s.actuators.empty() || !s.loads.empty() || !s.springs.empty() || !s.motors.empty() ||
      !s.prescribed.empty())
    return false;
  const double first = energy_of_bodies(before), gained = energy_of_bodies(s.bodies) - first;
  if (dry && report.contacts > 0 &&
      gained + lifted(s, before) > gain_by_contact(s, first, report.max_penetration, dt))
    return true;
  constexpr double kOfWater = 0.1, kWays = 2.0;
  const double g = s.options.gravity.norm();
  double possible = first + kOfWater * s.budget.last_motion().kinetic;
  for (const ReducedBody& body : before) {
    const double way = body.last_way.size() > 0 ? body.last_way.head<3>().norm() * dt : 0.0;
    const double mass = body_mass(body) + s.options.water_density * body.archetype->volume;
    possible += kWays * mass * g * (way + g * dt * dt);
  }
  return gained > possible;
}

}  // namespace archetide
