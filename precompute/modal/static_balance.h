#pragma once

#include "common/base/types.h"

namespace archetide {

/// The direction -H^-1 g with the eigenvalues of H (r x r, symmetric) made positive.
VecX descent_direction(const MatX& H, const VecX& g);

/// Static balance of a body under the dead `load` (r): a minimum of V.energy(q) - load . q, by
/// Newton's method with backtracking from q (r) on, until |V.force(q) - load| <= accuracy |load| or
/// 200 turns are done. V: an ElasticCubature, or what has its functions.
template <class Energy>
VecX static_balance(const Energy& V, const VecX& load, VecX q, double accuracy = 1e-5) {
  constexpr int kMostTurns = 200, kMostHalvings = 30;
  constexpr double kDecrease = 1e-4;
  double energy = V.energy(q) - load.dot(q);
  for (int turn = 0; turn < kMostTurns; ++turn) {
    const VecX g = V.force(q) - load;
    if (g.norm() <= accuracy * load.norm()) break;
    const VecX d = descent_direction(V.stiffness(q), g);
    double step = 1.0, trial = 0.0;
    for (int k = 0; k < kMostHalvings; ++k, step *= 0.5) {
      trial = V.energy(q + step * d) - load.dot(q + step * d);
      if (trial <= energy + kDecrease * step * g.dot(d)) break;
    }
    q += step * d;
    energy = trial;
  }
  return q;
}

}  // namespace archetide
