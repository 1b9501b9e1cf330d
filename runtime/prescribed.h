#pragma once

#include "runtime/state.h"

namespace archetide {

/// Puts the bodies that go as they are told (S8e) where they are now.
void place_prescribed(SimulationState& s);

/// Tells them how to go through a step of dt (s).
void aim_prescribed(SimulationState& s, double dt);

/// The fastest that a point of body b will be told to go within `dt` (s), m/s; 0: it is told nothing.
double prescribed_speed(const SimulationState& s, std::size_t b, double dt);

/// Work that a body that goes as it is told does on the rest in the velocities stage of a step, J, if
/// it has got the impulse `given` (N s, N m s about its centre); `before`: at the step's start.
double work_of_prescribed(const ReducedBody& before, const PrescribedMotion& motion,
                          const VecX& given);

}  // namespace archetide
