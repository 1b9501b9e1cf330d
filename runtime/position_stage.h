#pragma once

#include <optional>
#include <vector>

#include "runtime/joint_work.h"
#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// What the positions stage hands to the contacts and to the velocities stage; vectors hold a value
/// per body.
struct HalfStep {
  std::vector<Configuration> middle;           // at t + dt/2: where the velocities' terms are read
  std::vector<std::vector<Vec3>> read_points;  // surface, read back in time, m; empty: as it stands
  std::vector<StageContacts> held;             // points at walls
  std::vector<VecX> reaction;       // of the joints, 6 + r, N s and N m s; empty: no joints
  std::vector<JointedStart> start;  // jointed_starts()
  GroupContacts reachable;          // contacts of this stage, with the forces that they pushed
  GroupContacts touching;           // contacts of the velocities stage, once they are resolved
  double lost_in_contact = 0.0;     // energy of the bodies, J
  double work_in_contact = 0.0;     // of bodies that go as they are told, between the stages, J
};

/// Section 6, positions: water and bodies over dt/2 (s), coupled (Eq. 45, with joints Eq. 49); the
/// velocities of the half step take the bodies from x^n to x^{n+1}, joints closed and elements
/// whole. Nothing if the solve does not converge or a joint stays open.
std::optional<HalfStep> advance_positions(SimulationState& s, double dt, StepAttempt& attempt);

}  // namespace archetide
