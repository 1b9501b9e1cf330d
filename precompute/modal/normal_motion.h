#pragma once

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Integral over the surface of the square of each mode's normal displacement, r, m^4 per unit q^2:
/// the water that a mode moves goes with it. `modes`: 3 n x r, linear on every triangle.
VecX normal_motion_squared(const TriMesh& surface, const MatX& modes);

}  // namespace archetide
