#pragma once

#include <array>

#include "runtime/grid/grid.h"

namespace archetide {

/// Velocity of the water beyond each side of the tank, m/s; of sides that have none beyond it is not
/// read.
using VelocityBeyond = std::array<Vec3, 6>;

/// Mean velocity at each side.
VelocityBeyond mean_at_sides(const Grid& g, const MacField& u);

/// Water that the flow `carrier` has brought in through `sides` over dt had the velocity `beyond`:
/// the velocities `u` after advection, which know only the tank, become those of it and of what was
/// in the tank, by their shares of the path (W2b).
void bring_in_water(const Grid& g, const Sides& sides, const VelocityBeyond& beyond,
                    const MacField& carrier, double dt, MacField& u);

}  // namespace archetide
