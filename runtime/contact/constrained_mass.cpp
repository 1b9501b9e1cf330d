#include "runtime/contact/constrained_mass.h"

#include <Eigen/Eigenvalues>

#include "runtime/contact/contact_impulses.h"

namespace archetide {
namespace {

/// Pseudo-inverse of a symmetric positive semi-definite matrix.
MatX pseudo_inverse(const MatX& A) {
  constexpr double kRankCut = 1e-10;  // of the largest eigenvalue
  if (A.rows() == 0) return A;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(A);
  const VecX& values = eigen.eigenvalues();
  const double cut = kRankCut * values.maxCoeff();
  const VecX inverse = values.unaryExpr([&](double v) { return v > cut ? 1.0 / v : 0.0; });
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

ConstrainedMass::ConstrainedMass(const MatX& inverse_mass, MatX rows, VecX target)
    : ConstrainedMass(Response{inverse_mass * rows.transpose()}, rows, std::move(target)) {
  const MatX held = response_ * gram_inverse_ * response_.transpose();
  inverse_ = inverse_mass - 0.5 * (held + held.transpose());
}

ConstrainedMass::ConstrainedMass(Response response, MatX rows, VecX target)
    : rows_(std::move(rows)), target_(std::move(target)), response_(std::move(response.of_rows)) {
  if (target_.size() == 0) target_ = VecX::Zero(rows_.rows());
  const MatX gram = rows_ * response_;
  gram_inverse_ = pseudo_inverse(0.5 * (gram + gram.transpose()));
}

VecX ConstrainedMass::impulses(const VecX& y) const {
  return gram_inverse_ * (target_ - rows_ * y);
}

VecX ConstrainedMass::project(const VecX& y) const {
  if (rows_.rows() == 0) return y;
  return y + response_ * impulses(y);
}

std::vector<int> pressing_rows(const GeneralisedMass& H, const MatX& rows, const VecX& y,
                               const VecX& target) {
  constexpr double kStill = 1e-12;  // of the largest speed at the points
  std::vector<int> pressing;
  if (rows.rows() == 0) return pressing;
  const VecX wanted = target.size() > 0 ? target : VecX(VecX::Zero(rows.rows()));
  VecX pushed = y;
  push_apart(H, rows, MatX::Zero(2 * rows.rows(), rows.cols()), wanted, 0.0, pushed);
  const double speed = (rows * y - wanted).cwiseAbs().maxCoeff();
  for (int k = 0; k < rows.rows(); ++k)
    if (rows.row(k).dot(pushed) <= wanted[k] + kStill * speed) pressing.push_back(k);
  return pressing;
}

}  // namespace archetide
