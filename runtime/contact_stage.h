#pragma once

#include "runtime/position_stage.h"

namespace archetide {

/// Section 6, contact between the stages [GBF03]: what bodies touch on x^{n+1} changes v^n, and is
/// kept in `half` for the velocities stage. False if bodies sank into each other and a shorter step
/// than dt (s) may keep them apart.
bool resolve_contact(SimulationState& s, double dt, HalfStep& half, StepReport& report);

}  // namespace archetide
