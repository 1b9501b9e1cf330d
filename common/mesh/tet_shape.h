#pragma once

#include <array>

#include "common/mesh/tet_mesh.h"

namespace archetide {

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

}  // namespace archetide
