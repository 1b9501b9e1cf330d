#pragma once

#include "common/files/state_file.h"
#include "runtime/state.h"

namespace archetide {

/// Everything that a step hands to the next, written or read; the scene gives the rest. What is
/// read must come from the same scene (StateArchive::fail otherwise).
void visit_state(SimulationState& s, StateArchive& a);

}  // namespace archetide
