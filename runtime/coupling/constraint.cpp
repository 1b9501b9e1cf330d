#include "runtime/coupling/constraint.h"

#include <Eigen/Eigenvalues>
#include <vector>

namespace archetide {
namespace {

// (C H^-1 C^T)^+ with a relative cut of its eigenvalues.
MatX pseudo_inverse(const MatX& symmetric) {
  constexpr double kCut = 1e-10;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(symmetric);
  const VecX& values = eigen.eigenvalues();
  const double largest = values.size() ? values[values.size() - 1] : 0.0;
  VecX inverse = VecX::Zero(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (values[i] > kCut * largest) inverse[i] = 1.0 / values[i];
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

ConstrainedInverse constrain(const MatX& inverse_mass, const MatX& rows) {
  const MatX HC = inverse_mass * rows.transpose();
  ConstrainedInverse out;
  out.rows = rows;
  out.correction = HC * pseudo_inverse(rows * HC);
  out.inverse_mass = inverse_mass - out.correction * HC.transpose();
  out.inverse_mass = 0.5 * (out.inverse_mass + out.inverse_mass.transpose()).eval();
  return out;
}

VecX constraint_impulses(const MatX& inverse_mass, const MatX& rows, const VecX& y) {
  return -pseudo_inverse(rows * inverse_mass * rows.transpose()) * (rows * y);
}

bool release_pulling_rows(const MatX& inverse_mass, const VecX& without, MatX& rows) {
  const VecX impulse = constraint_impulses(inverse_mass, rows, without);
  const double largest = impulse.cwiseAbs().maxCoeff();
  constexpr double kPull = 1e-9;  // of the largest impulse: round-off of the pseudo-inverse
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < rows.rows(); ++i)
    if (impulse[i] >= -kPull * largest) kept.push_back(i);
  if (static_cast<Eigen::Index>(kept.size()) == rows.rows()) return false;
  rows = MatX(rows(kept, Eigen::all));
  return true;
}

}  // namespace archetide
