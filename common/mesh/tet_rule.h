#pragma once

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

}  // namespace archetide
