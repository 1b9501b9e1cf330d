#pragma once

#include "runtime/cut_cells/body_flux.h"
#include "runtime/pressure/pressure_system.h"

namespace archetide {

/// Generalised force (6 + r) of the part of the water pressure that p' leaves out,
/// -∫ π_h J^T n dA over the surface (docs/method.md, C2). π_h is linear on each piece of a triangle
/// within a cell:
///   wet, cell with an unknown:  rho g . (x - x_ref)    so that p' + π_h is the total pressure
///   wet, cell without one:      rho g . (x - x_I)      the static pressure under the interface
///   dry, cell with an unknown:  rho g . (x_I - x_ref)  cancels the p' = p'_I that F applies there
/// with x_I = x - phi grad phi / |grad phi|^2 the nearest point of the interface: beside a body that
/// moves |grad phi| is not 1, and a force that takes phi for the distance draws the body on [D96].
/// Exact for a plane surface at rest at any position of the body, and independent of x_ref.
/// `read_points` are the surface points earlier in the step, where the hydrostatic pressure is read
/// (pass surface.points when there is no step).
VecX hydrostatic_force(const Grid& g, const BodySurface& surface,
                       const std::vector<Vec3>& read_points, const PressureSystem& water);

/// The same of the members of a skin (at `points`, pressure read at `read_points`), and the
/// pressure across the cuts inside, which the members pass to each other: what rho g . (x - x_ref)
/// gives to the wet part of each member's own closed surface (read at `own_read[member]`) beyond
/// what it gives to the member's share of the skin. Neutral members hover, each by itself.
std::vector<VecX> hydrostatic_forces(const Grid& g, const WetSurface& skin,
                                     const std::vector<Vec3>& read_points,
                                     const std::vector<const std::vector<Vec3>*>& own_read,
                                     const PressureSystem& water);

}  // namespace archetide
