#pragma once

#include <vector>

#include "common/archetype/archetype.h"
#include "common/archetype/skin.h"

namespace archetide {

/// Coarser surfaces of a body for the water (docs/method.md, P8), each with half the triangles of
/// the one before it, down to some dozens. They enclose the volume of a.surface about its centroid;
/// their modes are those of the tets, continued from the nearest point of a.surface. Needs the
/// tets and node modes.
std::vector<SurfaceRung> surface_ladder(const Archetype& a);

/// The same of a skin; weights are those of the nearest point.
std::vector<SkinRung> surface_ladder(const Skin& skin);

}  // namespace archetide
