#pragma once

#include "common/archetype/archetype.h"

namespace archetide {

/// A body without modes that fills a closed, outward oriented surface evenly: its integrals
/// (divergence theorem), its surface about the centre of mass, no distance field. `density`: kg/m^3.
Archetype rigid_archetype(const std::string& name, const TriMesh& surface, double density);

}  // namespace archetide
