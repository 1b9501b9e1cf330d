#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Part (0 .. 1) of a closed surface's area in the grid that lies in cells where two sides of it
/// face away from each other: there the solid is thinner than a cell, and the water on both sides
/// has one pressure. A wall like that leaks; a body like that is not resolved.
double thin_part(const Grid& g, const std::vector<Vec3>& points,
                 const std::vector<Vec3i>& triangles);
inline constexpr double kTooThin = 0.5;  // from this part on

}  // namespace archetide
