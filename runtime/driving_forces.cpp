#include "runtime/driving_forces.h"

#include <algorithm>

namespace archetide {

std::vector<VecX> driving_forces(const SimulationState& s, double dt,
                                 const std::vector<Configuration>& at,
                                 const std::vector<ReducedBody>& before) {
  const double t = s.time() + 0.5 * dt;
  const std::vector<VecX> modal = modal_forces(s.actuators, t, s.bodies, at, s.options.modal.mass);
  std::vector<VecX> force(s.bodies.size());
  const auto begin = [&](int b) {  // false: it has not appeared yet
    const auto n = static_cast<std::size_t>(b);
    if (n >= force.size()) return false;
    if (force[n].size() == 0) force[n] = VecX::Zero(s.bodies[n].dofs());
    return true;
  };
  for (int b = 0; b < static_cast<int>(modal.size()); ++b)
    if (modal[b].size() > 0 && begin(b)) force[b].tail(s.bodies[b].r) = modal[b];
  for (const ExternalLoad& load : s.loads) {
    if (!begin(load.body)) continue;
    const ExternalLoad::Sample now = load.at(t);
    force[load.body].head<3>() += now.force;
    force[load.body].segment<3>(3) += now.torque;
  }
  const auto placed = [&](int b) {
    ReducedBody body = s.bodies[b];
    body.position = 0.5 * (before[b].position + body.position);
    body.rotation = at[b].rotation, body.q = at[b].q;
    return body;
  };
  for (const Spring& spring : s.springs) {
    begin(spring.a);
    if (spring.b >= 0) begin(spring.b);
    add_spring_force(spring, placed, s.options.modal.mass, force);
  }
  for (const Motor& motor : s.motors) {
    begin(motor.a);
    if (motor.b >= 0) begin(motor.b);
    add_motor_torque(motor, t, dt, placed, s.options.modal.mass, force);
  }
  return force;
}

bool is_driven(const SimulationState& s, std::size_t b) {
  const int n = static_cast<int>(b);
  const auto on_it = [&](const auto& item) { return item.body == n; };
  const auto holds_it = [&](const auto& item) { return item.a == n || item.b == n; };
  return std::any_of(s.actuators.begin(), s.actuators.end(), on_it) ||
         std::any_of(s.loads.begin(), s.loads.end(), on_it) ||
         std::any_of(s.springs.begin(), s.springs.end(), holds_it) ||
         std::any_of(s.motors.begin(), s.motors.end(), holds_it);
}

double stable_with_springs(const SimulationState& s, double dt) {
  for (const Spring& spring : s.springs)
    dt = std::min(dt, stable_spring_step(
                          spring, [&](int b) { return s.bodies[b]; }, s.options.modal, dt));
  return dt;
}

}  // namespace archetide
