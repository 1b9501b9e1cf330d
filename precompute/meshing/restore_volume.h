#pragma once

#include <vector>

#include "common/mesh/tet_mesh.h"

namespace archetide {

/// Moves the smooth vertices of a closed surface along their normals so that it encloses `volume`
/// (m^3) exactly. Nodes on a curved surface leave chords inside it: a deficit of -1 % at 8 nodes
/// around a tube's radius that would show as lost buoyancy. The move is proportional to the local
/// curvature, so flat parts and sharp edges stay. Returns false and does nothing when no small move
/// (at most kLargestMove of the sag) restores the volume. `share`: of its move that each vertex
/// makes, 0 to 1; empty: all of it.
bool restore_volume(TriMesh& surface, double volume, const std::vector<double>& share = {});

/// The same for the boundary of tets, curved or not; `share` has an entry for each node.
bool restore_volume(TetMesh& mesh, double volume, const std::vector<double>& share = {});

}  // namespace archetide
