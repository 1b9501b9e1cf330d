#pragma once

#include "common/mesh/tet_mesh.h"

namespace archetide {

/// The same tets with a node in the middle of every edge, behind the corners; edges stay straight.
TetMesh with_middle_nodes(const TetMesh& linear);

/// What became of the middle nodes on the boundary.
struct CurveReport {
  int moved = 0;  // now on the surface
  int held_back =
      0;  // of these only a part of the way, or not at all: a tet would have become poor
  double smallest_jacobian = 1.0;  // of all tets, in units of the straight tet's
};

/// Moves the middle nodes of the boundary's edges to the closest points of `surface`, those along
/// its sharp edges (more than `sharp_angle` degrees between the face normals) to the closest points
/// of these. A tet whose smallest Jacobian falls below kSmallestJacobian pulls its nodes back
/// towards the straight edges.
CurveReport curve_boundary(TetMesh& mesh, const TriMesh& surface, double sharp_angle);

/// In units of the straight tet's; the quadrature and the accuracy suffer below.
inline constexpr double kSmallestJacobian = 0.2;

}  // namespace archetide
