#pragma once

#include "runtime/state.h"

namespace archetide {

/// Generalised force, 6 + r, of actuators (S8) and external loads (S8c) on each body in the middle of
/// a step of dt (s); `at`: where the bodies are. Empty: none.
std::vector<VecX> driving_forces(const SimulationState& s, double dt,
                                 const std::vector<Configuration>& at);

/// Impulse of the external loads on body b in a step of dt.
Impulse external_impulse(const SimulationState& s, double dt, std::size_t b);

/// Whether an actuator or an external load acts on body b at any time.
bool is_driven(const SimulationState& s, std::size_t b);

}  // namespace archetide
