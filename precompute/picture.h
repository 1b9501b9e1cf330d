#pragma once

#include <vector>

#include "common/image.h"
#include "common/tri_mesh.h"

namespace archetide {

/// A surface seen from the front, a little from the right and above (parallel rays, z up), lit from
/// the camera's left; `value` (of each vertex, 0 .. 1) gives the colour from blue to yellow. The
/// box is in the middle of the picture and fills it.
Image draw_surface(const TriMesh& surface, const std::vector<double>& value,
                   const Eigen::AlignedBox3d& box, int width, int height);

}  // namespace archetide
