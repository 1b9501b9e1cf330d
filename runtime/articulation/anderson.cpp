#include "runtime/articulation/anderson.h"

#include <Eigen/QR>

namespace archetide {

VecX Anderson::step(const VecX& x, const VecX& f) {
  if (last_x_.size() > 0) {
    dx_.push_back(x - last_x_);
    df_.push_back(f - last_f_);
    if (static_cast<int>(dx_.size()) > depth_) dx_.erase(dx_.begin()), df_.erase(df_.begin());
  }
  last_x_ = x, last_f_ = f;
  if (dx_.empty()) return f;
  MatX dF(f.size(), static_cast<long>(df_.size()));
  for (std::size_t k = 0; k < df_.size(); ++k) dF.col(static_cast<long>(k)) = df_[k];
  Eigen::CompleteOrthogonalDecomposition<MatX> fit;
  fit.setThreshold(1e-8);  // differences that have become parallel tell nothing new
  const VecX gamma = fit.compute(dF).solve(f);
  VecX step = f;
  for (std::size_t k = 0; k < df_.size(); ++k)
    step -= gamma[static_cast<long>(k)] * (dx_[k] + df_[k]);
  return step;
}

}  // namespace archetide
