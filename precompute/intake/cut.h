#pragma once

#include <vector>

#include "common/mesh/tri_mesh.h"
#include "precompute/intake/regions.h"

namespace archetide {

/// The part of a solid that all the cuts keep: a closed surface, flat across the cuts (balls and
/// cylinders are cut by polyhedra of 8192 faces and of 128 sides). Parts that complement each other
/// have the volume of the whole to round-off. Throws InputError when nothing is left or when the
/// result is not manifold (a part that hangs together by an edge or a corner).
TriMesh cut_solid(const TriMesh& solid, const std::vector<Cut>& cuts);

/// The region as a closed outward polyhedron; half-spaces reach `reach` (m) from their point.
TriMesh region_surface(const Region& region, double reach);

}  // namespace archetide
