#include "runtime/solid/nodal_inverse.h"

#include <Eigen/LU>
#include <utility>

#include "common/base/check.h"

namespace archetide {
namespace {

/// C (1 + B C)^-1, symmetric: what the inverse mass loses where the mass gains C and B is the
/// inverse's block before.
MatX loss_of(const MatX& B, const MatX& C) {
  const MatX G = C * (MatX::Identity(C.rows(), C.cols()) + B * C).inverse();
  return 0.5 * (G + G.transpose());
}

}  // namespace

NodalInverse::NodalInverse(GeneralisedMass H) : H_(std::move(H)) {
  ARCHETIDE_CHECK(H_.nodal);
  block_ = space().seen_velocity(seen_answers());
  block_ = 0.5 * (block_ + block_.transpose()).eval();
}

// H^-1 of unit seen forces, (6 + 3 n) x (6 + r).
MatX NodalInverse::seen_answers() const {
  const MatX of_modes = H_.nodal->answers_of_modes();
  MatX X = MatX::Zero(size(), 6 + of_modes.cols());
  X.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / H_.mass);
  X.block<3, 3>(3, 3) = H_.inertia_inverse;
  X.bottomRightCorner(of_modes.rows(), of_modes.cols()) = of_modes;
  return X;
}

void NodalInverse::add_seen(const MatX& C) {
  ARCHETIDE_CHECK(losses_.empty());
  take(seen_answers(), loss_of(block_, C));
}

void NodalInverse::add(const MatX& U, const MatX& C) {
  MatX X = solve(U);
  const MatX G = loss_of(U.transpose() * X, C);
  take(std::move(X), G);
}

void NodalInverse::take(MatX X, const MatX& G) {
  MatX seen = space().seen_velocity(X);
  const MatX lost = seen * G * seen.transpose();
  block_ -= 0.5 * (lost + lost.transpose());
  losses_.push_back(std::make_shared<const Loss>(Loss{std::move(X), G, std::move(seen)}));
}

// The first loss is that of add_seen: its X are the answers to unit seen forces.
MatX NodalInverse::solve_seen(const MatX& f) const {
  ARCHETIDE_CHECK(!losses_.empty() && losses_[0]->X.cols() == f.rows());
  MatX y = losses_[0]->X * f;
  for (const auto& loss : losses_)
    y.noalias() -= loss->X * (loss->G * (loss->seen.transpose() * f)).eval();
  return y;
}

MatX NodalInverse::solve(const MatX& f) const {
  std::vector<MatX> one = {f};
  solve({this}, one);
  return std::move(one[0]);
}

// Eqs. 10 and 34, columns side by side.
void NodalInverse::solve(const std::vector<const NodalInverse*>& inverses, std::vector<MatX>& f) {
  std::vector<const NodalMass*> masses;
  std::vector<MatX> nodal;
  for (std::size_t b = 0; b < f.size(); ++b) {
    masses.push_back(inverses[b]->H_.nodal.get());
    nodal.push_back(f[b].bottomRows(masses[b]->size()));
  }
  NodalMass::solve(masses, nodal);
  for (std::size_t b = 0; b < f.size(); ++b) {
    const GeneralisedMass& H = inverses[b]->H_;
    std::vector<MatX> lost;
    for (const auto& loss : inverses[b]->losses_)
      lost.push_back(loss->G * (loss->X.transpose() * f[b]));
    f[b].topRows<3>() /= H.mass;
    f[b].middleRows<3>(3) = (H.inertia_inverse * f[b].middleRows<3>(3)).eval();
    f[b].bottomRows(nodal[b].rows()) = nodal[b];
    for (std::size_t k = 0; k < lost.size(); ++k)
      f[b].noalias() -= inverses[b]->losses_[k]->X * lost[k];
  }
}

}  // namespace archetide
