#include "runtime/driving_forces.h"

#include <algorithm>

namespace archetide {

std::vector<VecX> driving_forces(const SimulationState& s, double dt,
                                 const std::vector<Configuration>& at) {
  const double t = s.time() + 0.5 * dt;
  const std::vector<VecX> modal = modal_forces(s.actuators, t, s.bodies, at, s.options.modal.mass);
  std::vector<VecX> force(s.bodies.size());
  for (std::size_t b = 0; b < force.size(); ++b) {
    if (modal[b].size() == 0) continue;
    force[b] = VecX::Zero(s.bodies[b].dofs());
    force[b].tail(s.bodies[b].r) = modal[b];
  }
  for (const ExternalLoad& load : s.loads) {
    const auto b = static_cast<std::size_t>(load.body);
    if (b >= force.size()) continue;  // has not appeared yet
    if (force[b].size() == 0) force[b] = VecX::Zero(s.bodies[b].dofs());
    const ExternalLoad::Sample now = load.at(t);
    force[b].head<3>() += now.force;
    force[b].segment<3>(3) += now.torque;
  }
  return force;
}

Impulse external_impulse(const SimulationState& s, double dt, std::size_t b) {
  Impulse given;
  for (const ExternalLoad& load : s.loads) {
    if (load.body != static_cast<int>(b)) continue;
    const ExternalLoad::Sample now = load.at(s.time() + 0.5 * dt);
    given += impulse_at(s.bodies[b].position, dt * now.force, dt * now.torque);
  }
  return given;
}

bool is_driven(const SimulationState& s, std::size_t b) {
  const auto on_it = [&](const auto& item) { return item.body == static_cast<int>(b); };
  return std::any_of(s.actuators.begin(), s.actuators.end(), on_it) ||
         std::any_of(s.loads.begin(), s.loads.end(), on_it);
}

}  // namespace archetide
