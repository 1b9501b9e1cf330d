#pragma once

#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// Whether the bodies have gained more energy in a step of dt (s) than can be there for them: what
/// they had in the state `before` once more, a tenth of the water's kinetic energy, and what weight
/// and buoyancy do on twice the way that they would go on. A light body that a stream strikes in a
/// long step is thrown otherwise [D63]. Not asked where actuators, external loads, springs or motors work. Bodies that only touch each
/// other (`dry`; contacts and overlap of `report`) gain nothing at all, potential energy included,
/// but for the error of a step.
bool bodies_are_thrown(const SimulationState& s, const std::vector<ReducedBody>& before,
                       const StepReport& report, bool dry, double dt);

}  // namespace archetide
