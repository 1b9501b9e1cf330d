#pragma once

#include <array>
#include <vector>

#include "common/tet_mesh.h"

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

/// Shape functions of a tet with N = 4 (linear) or 10 (quadratic: corners, then kTetEdges) nodes.
template <int N>
struct TetShape {
  using Values = Eigen::Matrix<double, N, 1>;
  using Gradients = Eigen::Matrix<double, 3, N>;

  static Values values(const Vec3& L);        // 1
  static Gradients gradients(const Vec3& L);  // with respect to L1, L2, L3
};

template <>
TetShape<4>::Values TetShape<4>::values(const Vec3& L);
template <>
TetShape<4>::Gradients TetShape<4>::gradients(const Vec3& L);
template <>
TetShape<10>::Values TetShape<10>::values(const Vec3& L);
template <>
TetShape<10>::Gradients TetShape<10>::gradients(const Vec3& L);

/// Shape functions at the points of a rule, computed once.
template <int N>
struct ShapeTable {
  TetRule rule;
  std::vector<typename TetShape<N>::Values> values;
  std::vector<typename TetShape<N>::Gradients> gradients;

  explicit ShapeTable(TetRule r);
};

/// The nodes of a tet: corners, then middle nodes.
template <int N>
std::array<int, N> element_nodes(const TetMesh& mesh, int tet);

template <>
std::array<int, 4> element_nodes<4>(const TetMesh& mesh, int tet);
template <>
std::array<int, 10> element_nodes<10>(const TetMesh& mesh, int tet);

/// Positions of the nodes, 3 x N, m.
template <int N>
Eigen::Matrix<double, 3, N> element_positions(const TetMesh& mesh, const std::array<int, N>& nodes);

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
