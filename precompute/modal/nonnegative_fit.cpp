#include "precompute/modal/nonnegative_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace archetide {
namespace {

using Columns = std::vector<Eigen::Index>;

/// Least squares on some columns, from the normal equations.
VecX least_squares(const MatX& gram, const VecX& right, const Columns& in) {
  const MatX part = gram(in, in);
  return part.ldlt().solve(right(in));
}

/// The way from x towards the least squares solution on the columns `in`, as far as no weight is
/// negative; columns that reach 0 leave, until all of the solution can be taken.
void settle(const MatX& gram, const VecX& right, Columns& in, VecX& x) {
  while (true) {
    const VecX goal = least_squares(gram, right, in);
    double share = 1.0;
    for (std::size_t k = 0; k < in.size(); ++k)
      if (goal[Eigen::Index(k)] <= 0.0)
        share = std::min(share, x[in[k]] / (x[in[k]] - goal[Eigen::Index(k)]));
    for (std::size_t k = 0; k < in.size(); ++k)
      x[in[k]] += share * (goal[Eigen::Index(k)] - x[in[k]]);
    if (share >= 1.0) return;
    constexpr double kZero = 1e-14;
    const double largest = x.maxCoeff();
    const auto gone = [&](Eigen::Index i) { return x[i] <= kZero * largest; };
    for (const Eigen::Index i : in)
      if (gone(i)) x[i] = 0.0;
    in.erase(std::remove_if(in.begin(), in.end(), gone), in.end());
  }
}

}  // namespace

VecX sparse_nonnegative_fit(const MatX& A, const VecX& b, double tolerance, Eigen::Index most) {
  const VecX norms = A.colwise().norm().transpose();
  const MatX gram = A.transpose() * A;
  const VecX right = A.transpose() * b;
  VecX x = VecX::Zero(A.cols());
  Columns in;
  for (Eigen::Index turn = 0; turn < 3 * most && Eigen::Index(in.size()) < most; ++turn) {
    const VecX rest = b - A * x;
    if (rest.norm() <= tolerance * b.norm()) break;
    VecX gain = (A.transpose() * rest).cwiseQuotient(norms);
    for (const Eigen::Index i : in) gain[i] = 0.0;
    Eigen::Index best;
    if (gain.maxCoeff(&best) <= 0.0) break;
    in.push_back(best);
    settle(gram, right, in, x);
  }
  return x;
}

}  // namespace archetide
