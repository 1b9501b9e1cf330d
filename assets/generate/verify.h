#pragma once

#include <string>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// What is wrong with a surface that should be closed, manifold, connected, outward and free of
/// slivers, or "" if nothing is.
std::string surface_fault(const TriMesh& mesh);

/// Smallest angle of any triangle, degrees.
double smallest_angle(const TriMesh& mesh);

}  // namespace archetide
