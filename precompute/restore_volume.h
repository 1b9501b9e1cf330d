#pragma once

#include "common/tet_mesh.h"

namespace archetide {

/// Moves the smooth boundary nodes along their normals so that the mesh fills `volume` (m^3)
/// exactly. Nodes on the surface leave chords inside it: a deficit of -1 % at 8 nodes around a
/// tube's radius that would show as lost buoyancy. The move is proportional to the local curvature,
/// so flat parts and sharp edges stay. Does nothing when no small move (at most kLargestMove of the
/// sag) restores the volume.
void restore_volume(TetMesh& mesh, double volume);

}  // namespace archetide
