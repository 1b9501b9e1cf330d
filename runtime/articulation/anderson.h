#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Anderson acceleration of a fixed point x = x + f(x) [And65], [WN11]: the next
/// x from the last few, so that the combination of their residuals f is least.
class Anderson {
 public:
  explicit Anderson(int depth) : depth_(depth) {}
  /// The step to add to x, given f(x) there; both of one size throughout.
  VecX step(const VecX& x, const VecX& f);

 private:
  int depth_;
  VecX last_x_, last_f_;
  std::vector<VecX> dx_, df_;  // newest last
};

}  // namespace archetide
