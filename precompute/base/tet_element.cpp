#include "precompute/base/tet_element.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace archetide {
namespace {

/// Gauss-Jacobi rule of m points on [0, 1] for the weight (1 - x)^a [GW69].
void gauss_jacobi(int m, int a, VecX& points, VecX& weights) {
  MatX T = MatX::Zero(m, m);  // recurrence of the Jacobi polynomials P^(a, 0) on [-1, 1]
  for (int k = 0; k < m; ++k) {
    const double s = 2.0 * k + a;
    T(k, k) = a == 0 ? 0.0 : -double(a) * a / (s * (s + 2.0));
    if (k > 0)
      T(k, k - 1) = T(k - 1, k) =
          std::sqrt(4.0 * k * k * (k + a) * (k + a) / (s * s * (s + 1.0) * (s - 1.0)));
  }
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(T);
  points = 0.5 * (eigen.eigenvalues().array() + 1.0);
  weights = eigen.eigenvectors().row(0).transpose().cwiseAbs2() / (a + 1.0);
}

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

TetRule four_point_rule() {
  const double near = (5.0 + 3.0 * std::sqrt(5.0)) / 20.0, far = (5.0 - std::sqrt(5.0)) / 20.0;
  TetRule rule;
  for (int k = 0; k < 4; ++k) {
    Vec3 L = Vec3::Constant(far);
    if (k > 0) L[k - 1] = near;
    rule.points.push_back(L);
    rule.weights.push_back(1.0 / 24.0);
  }
  return rule;
}

TetRule conical_rule(int m) {
  VecX x, wx, y, wy, z, wz;
  gauss_jacobi(m, 2, x, wx);
  gauss_jacobi(m, 1, y, wy);
  gauss_jacobi(m, 0, z, wz);
  TetRule rule;
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < m; ++j)
      for (int k = 0; k < m; ++k) {
        rule.points.emplace_back(x[i], (1.0 - x[i]) * y[j], (1.0 - x[i]) * (1.0 - y[j]) * z[k]);
        rule.weights.push_back(wx[i] * wy[j] * wz[k]);
      }
  return rule;
}

template <int N>
ShapeTable<N>::ShapeTable(TetRule r) : rule(std::move(r)) {
  for (const Vec3& L : rule.points) {
    values.push_back(TetShape<N>::values(L));
    gradients.push_back(TetShape<N>::gradients(L));
  }
}
template struct ShapeTable<4>;
template struct ShapeTable<10>;

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
