#pragma once

#include <cstddef>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// The closed manifold surface with `faces` triangles, or with as few as it can have without a
/// triangle that turns over: edges collapse into points that keep the volume and, where that leaves
/// them free, cost the surface least [LT98]. The same surface gives the same result.
TriMesh simplify_surface(const TriMesh& surface, std::size_t faces);

}  // namespace archetide
