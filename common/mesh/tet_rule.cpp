#include "common/mesh/tet_rule.h"

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

}  // namespace archetide
