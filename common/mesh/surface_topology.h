#pragma once

#include <array>
#include <vector>

#include "common/mesh/mesh_sdf.h"  // winding_number
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// An edge of a triangle surface with the triangles around it.
struct SurfaceEdge {
  int a = 0, b = 0;               // vertices, a < b
  std::vector<int> triangles;     // in ascending order
  std::vector<bool> runs_a_to_b;  // for each triangle: the direction in which it passes the edge
};

/// All edges, ordered by (a, b).
std::vector<SurfaceEdge> surface_edges(const TriMesh& mesh);

/// Vertices whose triangles do not form one fan (two cones that touch in a point). All edges must
/// be manifold.
std::vector<int> pinched_vertices(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges);

/// Whether a triangle has no area: its corners lie in a line to round-off.
bool is_degenerate(const TriMesh& mesh, int triangle);

/// Turns the fewer triangles of each shell round so that they agree with each other. Returns how
/// many were turned, -1 if the surface has only one side. All edges must have two triangles.
int orient_consistently(TriMesh& mesh, const std::vector<SurfaceEdge>& edges);

/// The shell of each triangle (connected across edges), numbered from 0 by their first triangles.
std::vector<int> shells(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges, int& count);

}  // namespace archetide
