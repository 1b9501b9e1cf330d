#pragma once

#include <array>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace archetide {

/// A quadrature point on the boundary of linear or quadratic tets.
struct BoundaryPoint {
  std::array<int, 6> nodes;       // of its face: corners, then the middles of 01, 12, 20
  int count = 0;                  // 3 (linear) or 6
  Eigen::Matrix<double, 6, 1> N;  // their shape functions here
  Vec3 position;                  // m
  Vec3 area;                      // outward normal times the area that the point stands for, m^2
};

/// Seven points on every face, exact for degree 5 on flat faces; curved ones are taken as they are.
std::vector<BoundaryPoint> boundary_points(const TetMesh& mesh);

}  // namespace archetide
