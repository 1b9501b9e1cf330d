#pragma once

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "precompute/modal/boundary_quadrature.h"
#include "precompute/modal/modes.h"

namespace archetide::wet_sphere {

/// omega a / c_s of the coupled elastic sphere in unbounded liquid, Poisson 0.3, n = 2, density
/// ratio 0.5 (closed form).
inline constexpr double kExact = 1.673954822;

/// The five real spherical harmonics of degree 2, orthonormal on the unit sphere.
inline Eigen::Matrix<double, 5, 1> harmonics(const Vec3& n) {
  const double c = std::sqrt(15.0 / (4.0 * std::numbers::pi));
  return {c * n[0] * n[1], c * n[1] * n[2], c * n[2] * n[0], 0.5 * c * (n[0] * n[0] - n[1] * n[1]),
          c / (2.0 * std::sqrt(3.0)) * (3.0 * n[2] * n[2] - 1.0)};
}

/// Added mass of the modes of the unit ball in a liquid of density `rho`, degree 2 only: the
/// potential flow around a sphere answers a normal velocity Y_nm with the pressure rho a / (n + 1)
/// Y_nm.
inline MatX added_mass(const TetMesh& mesh, const MatX& modes, double rho) {
  MatX parts = MatX::Zero(5, modes.cols());  // normal displacement in harmonics
  for (const BoundaryPoint& p : boundary_points(mesh)) {
    const Vec3 n = p.position.normalized();
    for (int i = 0; i < p.count; ++i)
      parts += p.area.norm() * p.N[i] * harmonics(n) *
               (n.transpose() * modes.middleRows<3>(3 * p.nodes[i]));
  }
  return rho / 3.0 * parts.transpose() * parts;
}

/// omega a / c_s of the lowest wet mode (nu = 0.3) in the basis of the first `columns` vectors.
inline double lowest(const TetMesh& mesh, const ModesResult& modes, Eigen::Index columns,
                     const Material& material, double rho) {
  const MatX K = modes.K_r.topLeftCorner(columns, columns);
  const MatX M = modes.M_r.topLeftCorner(columns, columns) +
                 added_mass(mesh, modes.node_modes.leftCols(columns), rho);
  const VecX values = Eigen::GeneralizedSelfAdjointEigenSolver<MatX>(K, M).eigenvalues();
  return std::sqrt(values[0]) / std::sqrt(material.young / 2.6 / material.density);
}

}  // namespace archetide::wet_sphere
