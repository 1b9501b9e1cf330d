#pragma once

#include <array>
#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Edges of a tet in the order of its middle nodes (VTK's order of a quadratic tet).
inline constexpr std::array<std::array<int, 2>, 6> kTetEdges = {
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};

/// Linear or quadratic tetrahedra, positively oriented: det(x1-x0, x2-x0, x3-x0) > 0.
struct TetMesh {
  std::vector<Vec3> nodes;                 // n, m
  std::vector<std::array<int, 4>> tets;    // nt, node indices of the corners
  std::vector<std::array<int, 6>> mids{};  // nt: nodes on the edges (quadratic), or empty (linear)

  int order() const { return mids.empty() ? 1 : 2; }
};

/// Of the straight tet between the corners, m^3.
double tet_volume(const TetMesh& mesh, int tet);

/// The boundary of a tet mesh as an outward oriented surface of flat triangles, four for each face
/// of a quadratic tet; surface_to_node[v] is the node of vertex v.
TriMesh boundary_surface(const TetMesh& mesh, std::vector<int>& surface_to_node);

/// The tet behind each triangle of boundary_surface().
std::vector<int> tets_at_boundary(const TetMesh& mesh);

}  // namespace archetide
