#pragma once

#include "runtime/output/surface_mesh.h"

namespace archetide {

/// The twelve edges of a box as square bars of the given thickness, just outside the box.
SurfaceMesh box_edges(const Vec3& low, const Vec3& high, double thickness);

}  // namespace archetide
