#pragma once

#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// One coupled solve a step [D4] instead of the two of Section 6 (Scheme::kSingle): poses are
/// predicted with v^n, contact, the velocities stage over dt (s), then poses again from x^n. False
/// if the solve does not converge.
bool step_with_one_solve(SimulationState& s, double dt, StepAttempt& attempt);

}  // namespace archetide
