#include "precompute/modal/static_balance.h"

#include <Eigen/Eigenvalues>

namespace archetide {

VecX descent_direction(const MatX& H, const VecX& g) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(H);
  const double floor = 1e-8 * eigen.eigenvalues().cwiseAbs().maxCoeff();
  const VecX values = eigen.eigenvalues().cwiseAbs().cwiseMax(floor);
  return -eigen.eigenvectors() * (eigen.eigenvectors().transpose() * g).cwiseQuotient(values);
}

}  // namespace archetide
