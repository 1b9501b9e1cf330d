#pragma once

#include "runtime/position_stage.h"

namespace archetide {

/// Section 6, velocities: the water's surface moves, the water is advected (Eq. 22), and the solve
/// over dt (s) with all forces (Eq. 45, with joints Eq. 49) ends the step. `drive`: B^T f of each
/// body's actuators in the middle of the step, r, N m, or empty. False if it does not converge.
bool advance_velocities(SimulationState& s, double dt, HalfStep& half,
                        const std::vector<VecX>& drive, StepReport& report);

}  // namespace archetide
