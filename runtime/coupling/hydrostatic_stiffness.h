#pragma once

#include "runtime/cut_cells/body_flux.h"
#include "runtime/pressure/pressure_system.h"

namespace archetide {

/// How the pressure of still water resists a change of a body's shape, -d f_q / dq of its modal force
/// f_q (docs/method.md, S14a).
struct HydrostaticStiffness {
  LoadStiffness whole;       // symmetric; empty: none
  LoadStiffness of_normals;  // of that what comes from the normals alone, at a pressure that stays
};

/// The vertices of the surface have the pressure that stands under the water above them; above the
/// water there is none.
HydrostaticStiffness hydrostatic_stiffness(const Grid& g, const BodySurface& surface,
                                           const PressureSystem& water);

}  // namespace archetide
