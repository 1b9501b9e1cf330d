#pragma once

#include <vector>

#include "precompute/intake/repair.h"

namespace archetide {

// The steps of repair_surface(), one translation unit each. Coordinates and lengths of the file.

/// Makes edges meet that nearly do: drops repeated and degenerate faces, welds vertices of the
/// boundary closer than `tolerance`, and splits boundary edges at boundary vertices that lie on
/// them (T-junctions).
void close_seams(TriMesh& mesh, double tolerance, RepairReport& report);

/// Fills every hole: triangles of about the size around it, faired. The mesh is cut at non-manifold
/// edges first and oriented; one that cannot be is refused.
TriMesh fill_holes(const TriMesh& mesh, RepairReport& report);

/// The union of closed solids (each an outer shell and its cavities, facing out of the solid),
/// [CGAL corefinement]. Throws InputError when one intersects itself or the result is not manifold.
TriMesh unite(const std::vector<TriMesh>& solids);

/// Alpha wrap, [PRACH22]: outside of the input by `offset`.
TriMesh wrap(const TriMesh& mesh, double alpha, double offset);

/// The largest distance from the vertices and face centres of `from` to the surface `to`.
double farthest_distance(const TriMesh& from, const TriMesh& to);

}  // namespace archetide
