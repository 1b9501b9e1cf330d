#include "precompute/base/tet_element.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

double determinant(const Eigen::Matrix<double, 3, 10>& x, const Vec3& L) {
  return Mat3(x * TetShape<10>::gradients(L).transpose()).determinant();
}

template <int N>
TetMoments moments(const TetMesh& mesh, int tet, const ShapeTable<N>& table) {
  const Eigen::Matrix<double, 3, N> x = element_positions<N>(mesh, element_nodes<N>(mesh, tet));
  TetMoments result;
  for (std::size_t k = 0; k < table.values.size(); ++k) {
    const double w = table.rule.weights[k] * Mat3(x * table.gradients[k].transpose()).determinant();
    result.volume += w;
    result.first += w * (x * table.values[k]);
  }
  return result;
}

}  // namespace

template <>
Eigen::Matrix<double, 3, 4> reference_positions<4>() {
  Eigen::Matrix<double, 3, 4> x;
  x << Vec3::Zero(), Mat3::Identity();
  return x;
}

template <>
Eigen::Matrix<double, 3, 10> reference_positions<10>() {
  Eigen::Matrix<double, 3, 10> x;
  x.leftCols<4>() = reference_positions<4>();
  for (int e = 0; e < 6; ++e)
    x.col(4 + e) = 0.5 * (x.col(kTetEdges[e][0]) + x.col(kTetEdges[e][1]));
  return x;
}

bool is_straight(const Eigen::Matrix<double, 3, 4>&) { return true; }

bool is_straight(const Eigen::Matrix<double, 3, 10>& x) {
  for (int e = 0; e < 6; ++e) {
    const Vec3 a = x.col(kTetEdges[e][0]), b = x.col(kTetEdges[e][1]);
    if ((x.col(4 + e) - 0.5 * (a + b)).norm() > 1e-10 * (b - a).norm()) return false;
  }
  return true;
}

double smallest_jacobian(const Eigen::Matrix<double, 3, 10>& x) {
  const double straight =
      Mat3(x.leftCols<4>() * TetShape<4>::gradients(Vec3::Zero()).transpose()).determinant();
  double smallest = determinant(x, Vec3::Zero());
  for (int i = 0; i <= 3; ++i)
    for (int j = 0; i + j <= 3; ++j)
      for (int k = 0; i + j + k <= 3; ++k)
        smallest = std::min(smallest, determinant(x, Vec3(i, j, k) / 3.0));
  return smallest / straight;
}

TetMoments tet_moments(const TetMesh& mesh, int tet) {
  static const ShapeTable<4> linear(four_point_rule());    // degree 1
  static const ShapeTable<10> quadratic(conical_rule(3));  // degree 3 + 2
  return mesh.order() == 1 ? moments(mesh, tet, linear) : moments(mesh, tet, quadratic);
}

double mesh_volume(const TetMesh& mesh) {
  double volume = 0.0;
  for (int t = 0; t < int(mesh.tets.size()); ++t) volume += tet_moments(mesh, t).volume;
  return volume;
}

}  // namespace archetide
