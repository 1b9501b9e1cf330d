#pragma once

#include "runtime/position_stage.h"

namespace archetide {

/// Section 6, velocities: the water's surface moves, the water is advected (Eq. 22), and the solve
/// over dt (s) with all forces (Eq. 45, with joints Eq. 49) ends the step. `drive`: B^T f of each
/// body's actuators in the middle of the step, 6 + r (driving_forces), or empty; `before`: the bodies of x^n, v^n.
/// False if it does not converge, or if joints or bodies gain energy from nothing [D62, D63]: bodies
/// and surface are then in the middle of the step, and u^n is kept.
bool advance_velocities(SimulationState& s, const std::vector<ReducedBody>& before, double dt,
                        HalfStep& half, const std::vector<VecX>& drive, StepAttempt& attempt);

/// Before the first step: the velocities that the scene gave, as they are once water, bodies, joints
/// and walls have met (Eqs. 45, 49 with h -> 0): water that is given a speed towards a body or a
/// wall strikes it at once, not over a step in which both move. `dt`: of the step, s. Scenes that
/// begin at rest stay as they are, and so do velocities whose solve does not converge.
void meet_at_start(SimulationState& s, double dt);

}  // namespace archetide
