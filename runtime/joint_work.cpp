#include "runtime/joint_work.h"

#include <cmath>

namespace archetide {
namespace {

JointedStart start_of(const SimulationState& s, const ReducedBody& body) {
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), s.options.modal.mass);
  return {generalised_velocity(body, terms), body.P, body.L};
}

}  // namespace

std::vector<JointedStart> jointed_starts(const SimulationState& s) {
  std::vector<JointedStart> starts(s.joints.empty() ? 0 : s.bodies.size());
  for (const Joint& joint : s.joints)
    for (const int b : {joint.a, joint.b}) {
      if (b < 0 || starts[b].y.size() > 0) continue;
      if (s.bodies[b].r > 0) return {};
      starts[b] = start_of(s, s.bodies[b]);
    }
  return starts;
}

bool joints_drive(const SimulationState& s, const std::vector<JointedStart>& starts,
                  const std::vector<VecX>& reaction, const std::vector<StageResult>& velocities) {
  constexpr double kMostWork = 1e-4;  // of the energy there is
  double work = 0.0, energy = 0.0;
  for (std::size_t b = 0; b < starts.size(); ++b) {
    const JointedStart& start = starts[b];
    if (start.y.size() == 0) continue;
    const ReducedBody& body = s.bodies[b];
    if (body.P != start.P || body.L != start.L) return false;
    const VecX mean = 0.5 * (start.y + velocities[b].y);
    for (const VecX* impulse : {&reaction[b], &velocities[b].joint_reaction})
      if (impulse->size() > 0) work += impulse->dot(mean);
    const VecX& push = velocities[b].water_impulse;
    const bool wet = push.size() > 0 && !push.isZero(0.0);
    const double mass = body_mass(body),
                 moved = mass + (wet ? s.options.water_density * body.archetype->volume : 0.0);
    energy +=
        moved / mass * kinetic_energy(body) + moved * s.options.gravity.norm() * s.reach[b].rest;
  }
  return std::abs(work) > kMostWork * energy;
}

}  // namespace archetide
