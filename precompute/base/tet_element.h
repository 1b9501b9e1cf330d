#pragma once

#include <array>
#include <vector>

#include "common/mesh/tet_shape.h"

namespace archetide {

/// Points of a quadrature over the reference tet (L1, L2, L3 >= 0, L1 + L2 + L3 <= 1, volume 1/6).
struct TetRule {
  std::vector<Vec3> points;     // (L1, L2, L3)
  std::vector<double> weights;  // their sum is 1/6
};

/// Exact for polynomials of degree 2 (four points).
TetRule four_point_rule();
/// Exact for degree 2 m - 1: product of Gauss-Jacobi rules of m points in collapsed coordinates.
TetRule conical_rule(int m);

/// Shape functions at the points of a rule, computed once.
template <int N>
struct ShapeTable {
  TetRule rule;
  std::vector<typename TetShape<N>::Values> values;
  std::vector<typename TetShape<N>::Gradients> gradients;

  explicit ShapeTable(TetRule r);
};

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
