#pragma once

#include "runtime/grid/grid.h"
#include "runtime/output/surface_mesh.h"

namespace archetide {

/// The boundary of the water {phi < 0} inside the tank: marching cubes [LC87] on
/// the cell centres plus one layer of samples exactly on the tank's sides, beyond which there is
/// air. Closed and outward oriented; vertices lie where linear interpolation of phi (size: cells)
/// vanishes, or on the tank's sides; normals are those of phi, or of the tank on its sides.
SurfaceMesh water_surface(const Grid& grid, const Array3<double>& phi);

}  // namespace archetide
