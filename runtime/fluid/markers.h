#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Passive points that the water carries: plankton, dye. They cost nothing when there are none.

/// Moves points with u over dt (midpoint rule, trilinear velocities), clamped to the tank.
void advect_points(const Grid& g, const MacField& u, double dt, std::vector<Vec3>& points);

/// Points above the water's surface go back to it, down the gradient of phi; clamped to the tank.
void return_to_water(const Grid& g, const Array3<double>& phi, std::vector<Vec3>& points);

}  // namespace archetide
