#pragma once

#include "runtime/grid/grid.h"

namespace archetide {

/// Makes phi the signed distance to its own zero level within `band` (m), and -band or +band
/// beyond. Cells next to the interface take |phi| / |grad phi|, never more than the nearest
/// crossing along an axis; the others follow from the second-order upwind eikonal equation. A cell
/// whose value would change by less than 1e-9 dx keeps it, so that a surface at rest is not moved
/// by rounding. Cells with solid != 0 (an empty mask: none) are measured through: the surface goes
/// on in them where sheet != 0 (see continue_surface); where phi changes sign elsewhere inside a
/// body or against it is no surface. Beyond the sides in `air_beyond` there is air: water that stands
/// there ends at the side.
/// Upwind updates repeated until nothing changes, as in [Zha05].
void redistance(const Grid& g, Array3<double>& phi, double band,
                const Array3<unsigned char>& solid = {}, const Array3<unsigned char>& sheet = {},
                const Sides& air_beyond = {});

}  // namespace archetide
