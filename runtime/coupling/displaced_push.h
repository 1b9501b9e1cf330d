#pragma once

#include <vector>

#include "runtime/cut_cells/body_flux.h"
#include "runtime/pressure/pressure_system.h"

namespace archetide {

/// What a body owes to the water that it has displaced between the two solves of a step, (6 + r)
/// N s for each member of `surface`. The first solve, with the surface at `before` (m, by vertex),
/// gave the push dt grad p' / rho to the water and the opposite impulse to bodies; the second
/// begins without either, but the push that it takes back from the water is that of the water that
/// is there now. The difference, rho push over the volume that the surface has swept,
///     integral over the surface of rho (push . v) (d . n) dA,   d: way of the surface,
/// is what makes the impulse of a step belong to its middle. Without it the step is of first order
/// and bodies that move lose energy [D47].
/// `water.push` must be there.
std::vector<VecX> displaced_push(const Grid& g, const WetSurface& surface,
                                 const std::vector<Vec3>& before, const FreeSurface& water,
                                 double density, double dt);

}  // namespace archetide
