#pragma once

#include <array>
#include <vector>

#include "common/tri_mesh.h"

namespace archetide {

/// Linear tetrahedra, positively oriented: det(x1-x0, x2-x0, x3-x0) > 0.
struct TetMesh {
  std::vector<Vec3> nodes;               // n, m
  std::vector<std::array<int, 4>> tets;  // nt, node indices
};

double tet_volume(const TetMesh& mesh, int tet);

/// The boundary of a tet mesh as an outward oriented surface; surface_to_node[v] is the node of
/// vertex v.
TriMesh boundary_surface(const TetMesh& mesh, std::vector<int>& surface_to_node);

}  // namespace archetide
