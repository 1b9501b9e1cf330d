#pragma once

#include <vector>

#include "runtime/output/surface_mesh.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// The deformed surfaces of all bodies in the world, body b's vertices marked with b.
SurfaceMesh bodies_surface(const std::vector<ReducedBody>& bodies);

}  // namespace archetide
