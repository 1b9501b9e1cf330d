#include "runtime/contact/nonnegative_least_squares.h"

#include <algorithm>
#include <vector>

#include <Eigen/Cholesky>

namespace archetide {
namespace {

/// Solution of A_PP s = b_P. Where a new point's row depends on the others but asks for more (two
/// points at one place, one deeper), A_PP is singular and s is far out along the exchange of the
/// one for the other.
VecX solve_pushing(const MatX& A, const VecX& b, const std::vector<int>& P) {
  constexpr double kSingular = 1e-11;  // pivots, of the largest diagonal entry
  MatX A_PP = A(P, P);
  const double largest = A_PP.diagonal().maxCoeff();
  Eigen::LDLT<MatX> factor(A_PP);
  if (factor.vectorD().minCoeff() <= kSingular * largest) {
    A_PP.diagonal().array() += kSingular * largest;
    factor.compute(A_PP);
  }
  return factor.solve(VecX(b(P)));
}

/// Takes `lambda` towards the solution of A_PP s = b_P; points that would have to pull leave the
/// set P.
void settle(const MatX& A, const VecX& b, std::vector<int>& P, VecX& lambda) {
  while (!P.empty()) {
    const VecX s = solve_pushing(A, b, P);
    double fraction = 1.0;
    for (std::size_t i = 0; i < P.size(); ++i)
      if (s[i] <= 0.0)
        fraction =
            lambda[P[i]] > 0.0 ? std::min(fraction, lambda[P[i]] / (lambda[P[i]] - s[i])) : 0.0;
    for (std::size_t i = 0; i < P.size(); ++i) lambda[P[i]] += fraction * (s[i] - lambda[P[i]]);
    if (fraction >= 1.0) return;

    // at least the point that limited the fraction leaves
    const double gone = 1e-14 * lambda.maxCoeff();
    const auto leaves = [&](int k) { return lambda[k] <= gone; };
    for (int k : P)
      if (leaves(k)) lambda[k] = 0.0;
    std::erase_if(P, leaves);
  }
}

}  // namespace

// Eq. K2.
VecX nonnegative_least_squares(const MatX& A, const VecX& b) {
  constexpr double kReached = 1e-12;  // of the largest target speed
  const int m = static_cast<int>(b.size());
  VecX lambda = VecX::Zero(m);
  if (m == 0) return lambda;
  const double reached = kReached * b.cwiseAbs().maxCoeff();
  std::vector<int> P;  // points that push
  VecX missing = b;
  for (int exchange = 0; exchange < 5 * m; ++exchange) {
    for (int k : P) missing[k] = 0.0;
    int worst = 0;
    if (missing.maxCoeff(&worst) <= reached) break;
    P.push_back(worst);
    settle(A, b, P, lambda);
    missing = b - A * lambda;
    // a point that left at once only repeats what the others hold
    if (lambda[worst] <= 0.0) missing[worst] = 0.0;
  }
  return lambda;
}

}  // namespace archetide
