#include "runtime/joint_closing.h"

#include <algorithm>
#include <cmath>

#include "runtime/articulation/pre_stabilisation.h"

namespace archetide {
namespace {

constexpr double kClosed = 1e-12, kGood = 1e-8;  // of the smallest jointed body

// Size of the smallest jointed body, m.
double smallest_jointed(const SimulationState& s) {
  double size = INFINITY;
  for (const Joint& joint : s.joints)
    for (const int b : {joint.a, joint.b})
      if (b >= 0) size = std::min(size, s.reach[b].rest);
  return size;
}

}  // namespace

bool close_joints(const SimulationState& s, const std::vector<FreeMotion>& motions,
                  const std::vector<char>& stopped, double dt, std::vector<VecX>& y,
                  std::vector<VecX>& reaction, StepAttempt& attempt) {
  if (s.joints.empty()) return true;
  const double size = smallest_jointed(s);
  const PreStabilised kept =
      pre_stabilise(s.joints, s.bodies, motions, stopped, dt, kClosed * size, kGood * size, y);
  if (kept.closed) {
    for (std::size_t b = 0; b < s.bodies.size(); ++b)
      if (kept.impulse[b].size() > 0 && reaction[b].size() > 0) reaction[b] += kept.impulse[b];
    return true;
  }
  attempt.open_joint = kept.widest, attempt.open_gap = kept.drift;
  return attempt.refuse(Refusal::kJointOpen);
}

bool seat_joints(const SimulationState& s, const std::vector<FreeMotion>& motions,
                 const std::vector<char>& stiff, double dt, std::vector<ReducedBody>& bodies) {
  const double size = smallest_jointed(s);
  std::vector<VecX> shift;  // over dt
  for (const ReducedBody& body : bodies) shift.push_back(VecX::Zero(body.dofs()));
  if (!pre_stabilise(s.joints, bodies, motions, stiff, dt, kClosed * size, kGood * size, shift)
           .closed)
    return false;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (shift[b].isZero(0.0)) continue;
    const Vec3 from = bodies[b].position;
    advance_pose(bodies[b], motions[b], shift[b], dt);
    bodies[b].L -= (bodies[b].position - from).cross(bodies[b].P);
  }
  return true;
}

}  // namespace archetide
