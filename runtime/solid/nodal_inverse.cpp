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

// H^-1 of unit reduced forces, (6 + 3 n) x (6 + r).
MatX reduced_answers(const GeneralisedMass& H) {
  const MatX of_modes = H.nodal->answers_of_modes();
  MatX X = MatX::Zero(6 + of_modes.rows(), 6 + of_modes.cols());
  X.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / H.mass);
  X.block<3, 3>(3, 3) = H.inertia_inverse;
  X.bottomRightCorner(of_modes.rows(), of_modes.cols()) = of_modes;
  return X;
}

}  // namespace

MatX RowForces::forces(const MatX& g) const {
  MatX f(6 + few.rows(), g.cols());
  f.topRows<6>() = whole * g;
  f.bottomRows(few.rows()) = few * g;
  f.bottomRows(few.rows()).noalias() += spread * (share * g).eval();
  return f;
}

MatX RowForces::velocities(const MatX& y) const {
  const auto u_dot = y.bottomRows(few.rows());
  MatX z = few.transpose() * u_dot;
  z.noalias() += whole.transpose() * y.topRows<6>();
  z.noalias() += share.transpose() * (spread.transpose() * u_dot).eval();
  return z;
}

NodalInverse::NodalInverse(GeneralisedMass H) : H_(std::move(H)) {
  ARCHETIDE_CHECK(H_.nodal);
  reduced_ = std::make_shared<const MatX>(reduced_answers(H_));
  block_ = space().reduced_velocity(*reduced_);
  block_ = 0.5 * (block_ + block_.transpose()).eval();
}

void NodalInverse::add_reduced(const MatX& C) {
  ARCHETIDE_CHECK(losses_.empty());
  take(*reduced_, loss_of(block_, C));
}

void NodalInverse::add(const MatX& U, const MatX& C) {
  MatX X = solve(U);
  const MatX G = loss_of(U.transpose() * X, C);
  take(std::move(X), G);
}

void NodalInverse::take(MatX X, const MatX& G) {
  MatX reduced = space().reduced_velocity(X);
  const MatX lost = reduced * G * reduced.transpose();
  block_ -= 0.5 * (lost + lost.transpose());
  losses_.push_back(std::make_shared<const Loss>(Loss{std::move(X), G, std::move(reduced)}));
}

MatX NodalInverse::solve_reduced(const MatX& f) const {
  MatX y = *reduced_ * f;
  for (const auto& loss : losses_)
    y.noalias() -= loss->X * (loss->G * (loss->reduced.transpose() * f)).eval();
  return y;
}

MatX NodalInverse::compliance(const RowForces& J) const {
  const NodalMass& mass = *H_.nodal;
  const MatX of_spread = mass.solve(J.spread);
  const MatX few = J.few.transpose() * of_spread, all = J.spread.transpose() * of_spread,
             both = (few + 0.5 * J.share.transpose() * all.transpose()) * J.share;
  MatX A = mass.compliance(J.few) + both + both.transpose();
  const auto v = J.whole.topRows<3>(), w = J.whole.bottomRows<3>();
  A += v.transpose() * v / H_.mass + w.transpose() * H_.inertia_inverse * w;
  for (const auto& loss : losses_) {
    const MatX lost = J.velocities(loss->X);
    A -= lost * loss->G * lost.transpose();
  }
  return 0.5 * (A + A.transpose());
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
