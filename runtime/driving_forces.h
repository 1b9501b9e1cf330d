#pragma once

#include "runtime/state.h"

namespace archetide {

/// Generalised force, 6 + r, of actuators (S8), external loads (S8c), springs (S8d) and motors (S8f) on each body in
/// the middle of a step of dt (s). `at`: how the bodies are turned and bent there; `before`: where they
/// were at its start (they are half way from there, or still there). Empty: none.
std::vector<VecX> driving_forces(const SimulationState& s, double dt,
                                 const std::vector<Configuration>& at,
                                 const std::vector<ReducedBody>& before);

/// Whether an actuator, an external load, a spring or a motor acts on body b at any time.
bool is_driven(const SimulationState& s, std::size_t b);
/// The longest step, at most dt, that the springs allow, s.
double stable_with_springs(const SimulationState& s, double dt);

}  // namespace archetide
