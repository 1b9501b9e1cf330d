#pragma once

#include <array>

#include "common/mesh/tet_rule.h"

namespace archetide {

/// Of the reference tet (volume 1/6).
template <int N>
Eigen::Matrix<double, 3, N> reference_positions();

template <>
Eigen::Matrix<double, 3, 4> reference_positions<4>();
template <>
Eigen::Matrix<double, 3, 10> reference_positions<10>();

/// True when all middle nodes are at the middles of straight edges (to 1e-10 of the edge).
bool is_straight(const Eigen::Matrix<double, 3, 4>& x);
bool is_straight(const Eigen::Matrix<double, 3, 10>& x);

/// Smallest det(dx/dL) of a quadratic tet over the 20 points of the cubic lattice, which determine
/// it (it is cubic), in units of that of the straight tet.
double smallest_jacobian(const Eigen::Matrix<double, 3, 10>& x);

/// Volume (m^3) and first moment about the origin (m^4) of one tet, curved edges included; exact.
struct TetMoments {
  double volume = 0.0;
  Vec3 first = Vec3::Zero();
};
TetMoments tet_moments(const TetMesh& mesh, int tet);

/// Of all tets, m^3.
double mesh_volume(const TetMesh& mesh);

}  // namespace archetide
