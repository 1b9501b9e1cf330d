#pragma once

#include "runtime/grid/grid.h"

namespace archetide {

/// Value of valid_source on faces that a solid closes.
inline constexpr unsigned char kClosedFace = 255;

/// Moves `advected` over dt with the flow `transporting`: MacCormack with the result clamped to the
/// corner values at the foot of the path [SFK08], midpoint back-traces clamped to the tank.
/// Computes the faces with target != 0; the others keep what `result` holds (zero if it had another
/// size). `valid_source` marks the faces whose `advected` means something, 1 those that were solved
/// for; where a path ends next to one that means nothing, the valid corners alone are averaged and
/// the second-order correction is left out. `result` must be another field than the sources.
void advect_velocity(const Grid& g, const MacField& transporting, const MacField& advected,
                     double dt, const FaceField<unsigned char>& valid_source,
                     const FaceField<unsigned char>& target, MacField& result);

/// Largest |component| over the faces with mask != 0 (all faces when mask is null), m/s; times
/// dt/dx it is the number of cells that a step may cross.
double cfl_speed(const MacField& u, const FaceField<unsigned char>* mask = nullptr);

/// The same, of faces with valid != 0, but at most `share` of those with valid == 1 may be faster,
/// by at most `factor` > 1. Between cfl_speed / factor and cfl_speed in 64 steps, m/s.
double speed_of_most(const MacField& u, const FaceField<unsigned char>& valid, double share,
                     double factor);

}  // namespace archetide
