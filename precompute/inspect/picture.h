#pragma once

#include <vector>

#include "common/files/image.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// A surface seen from the front, a little from the right and above (parallel rays, z up), lit from
/// the camera's left; `value` (of each vertex, 0 .. 1) gives the colour from blue to yellow. The
/// points of `frame` fill the picture but for `margin` around them (m), so that several shapes can
/// be drawn alike.
Image draw_surface(const TriMesh& surface, const std::vector<double>& value,
                   const std::vector<Vec3>& frame, double margin, int width, int height);

}  // namespace archetide
