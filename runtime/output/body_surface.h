#pragma once

#include <vector>

#include "runtime/articulation/skinning.h"
#include "runtime/output/surface_mesh.h"

namespace archetide {

/// The deformed surfaces of all bodies in the world, body b's vertices marked with b, with their
/// places at rest. Bodies under a skin are not among them: the skin is, marked with its first one.
SurfaceMesh bodies_surface(const std::vector<ReducedBody>& bodies,
                           const std::vector<SkinnedBodies>& skins = {});

}  // namespace archetide
