#include "runtime/thrown_bodies.h"

#include "runtime/statistics.h"

namespace archetide {

bool bodies_are_thrown(const SimulationState& s, const std::vector<ReducedBody>& before,
                       double dt) {
  if (!s.actuators.empty()) return false;
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
