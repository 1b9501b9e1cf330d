#include "runtime/joint_work.h"

#include <cmath>

namespace archetide {
namespace {

VecX velocity_of(const SimulationState& s, const ReducedBody& body) {
  return generalised_velocity(
      body, configuration_terms(body, current_configuration(body), s.options.modal.mass));
}

bool same_motion(const ReducedBody& a, const JointedStart& b) {
  return a.P == b.P && a.L == b.L && a.q_dot == b.q_dot;
}

}  // namespace

std::vector<JointedStart> jointed_starts(const SimulationState& s) {
  std::vector<JointedStart> starts(s.joints.empty() ? 0 : s.bodies.size());
  for (const Joint& joint : s.joints)
    for (const int b : {joint.a, joint.b})
      if (b >= 0 && starts[b].y.size() == 0) {
        const ReducedBody& body = s.bodies[b];
        starts[b] = {velocity_of(s, body), body.P, body.L, body.q_dot};
      }
  return starts;
}

bool joints_drive(const SimulationState& s, const HalfStep& half,
                  const std::vector<StageResult>& results) {
  constexpr double kMostWork = 1e-4;  // of the energy there is
  double work = 0.0, energy = 0.0;
  for (std::size_t b = 0; b < half.start.size(); ++b) {
    const JointedStart& start = half.start[b];
    if (start.y.size() == 0) continue;
    const ReducedBody& body = s.bodies[b];
    if (body.dofs() > 6 || !same_motion(body, start)) return false;
    const VecX mean = 0.5 * (start.y + results[b].y);
    for (const VecX* impulse : {&half.reaction[b], &results[b].joint_reaction})
      if (impulse->size() > 0) work += impulse->dot(mean);
    energy += kinetic_energy(body) + body_mass(body) * s.options.gravity.norm() * s.reach[b].rest;
  }
  return std::abs(work) > kMostWork * energy;
}

}  // namespace archetide
