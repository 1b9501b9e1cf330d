#pragma once

#include <vector>

#include "runtime/failure.h"
#include "runtime/fluid/fluid_state.h"
#include "runtime/solid/reduced_body.h"
#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// The first body that is not finite, or -1.
int broken_body(const std::vector<ReducedBody>& bodies);

/// Throws SimulationFailure naming the body and mode, or the cell, if anything is not finite.
void demand_finite(const std::vector<ReducedBody>& bodies, const FluidState& fluid,
                   const StepReport& report);

/// What a step of dt (s) that cannot be taken broke at: the joint that stays open, or the cell with
/// most divergence left and the body nearest to it.
SimulationFailure step_failure(const SimulationState& s, double dt, const StepAttempt& attempt);

}  // namespace archetide
