#pragma once

#include <vector>

#include "runtime/numerics/multigrid_level.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

/// The symmetric V(2,2) cycle, for levels that hold one right-hand side or many (MultigridLevel,
/// BlockLevel). The stages on a level follow each other in one wavefront over its planes.

/// What the first stage of a way down or up takes from memory while stage 1 or 2, so many planes
/// behind it, works in the cache: the hardware does not look beyond the strip.
inline MultigridLevel::Prefetch prefetch_of_stage(int stage) {
  if (stage == 1) return {false, 2};
  if (stage == 2) return {true, 3};
  return {};
}

/// The stages of a way down or up, stage(n, rows): 0 .. kWayStages - 1.
inline constexpr int kWayStages = 5;
template <class Level, class Stage>
void pass_planes(Level& level, Stage&& stage) {
  wavefront(
      level.nz, level.ny, level.strip(kWayStages), kWayStages, level.parallel,
      [&](int k) { return level.work_of(k); },
      [&](int n, int k, int first, int end) {
        stage(n, MultigridLevel::Rows{k, first, end});
      });
}

/// Stages 1, 2, 3, 4: black, red, black, red.
template <class Level>
void relax_at_stage(Level& level, int n, const MultigridLevel::Rows& rows) {
  level.relax(rows, n % 2 == 1 ? Colour::kBlack : Colour::kRed, prefetch_of_stage(n));
}

/// start(rows), which is the first red, then black, red, black, and the residual to the next level.
template <class Level, class Start>
void descend(Level& level, Level& coarse, Start&& start) {
  pass_planes(level, [&](int n, const MultigridLevel::Rows& rows) {
    if (n == 0) return start(rows);
    if (n == kWayStages - 1) return level.restrict_residual(rows, coarse);
    relax_at_stage(level, n, rows);
  });
}

/// The correction, then black, red, black, red; finish(rows) where that is done.
template <class Level, class Finish>
void ascend(Level& level, const Level& coarse, Finish&& finish) {
  pass_planes(level, [&](int n, const MultigridLevel::Rows& rows) {
    if (n == 0) return level.prolong(rows, coarse);
    relax_at_stage(level, n, rows);
    if (n == kWayStages - 1) finish(rows);
  });
}

}  // namespace archetide
