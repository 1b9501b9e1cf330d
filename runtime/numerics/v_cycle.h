#pragma once

#include <vector>

#include "runtime/numerics/multigrid_level.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

/// The symmetric V(2,2) cycle, for levels that hold one right-hand side or many (MultigridLevel,
/// BlockLevel). The stages on a level follow each other in one wavefront over its planes.

/// What the first stage of a way down or up takes from memory while stage 1 or 2, so many planes
/// behind it, works in the cache: the hardware does not look beyond the strip.
inline MultigridLevel::Ahead ahead_of_stage(int stage) {
  if (stage == 1) return {false, 2};
  if (stage == 2) return {true, 3};
  return {};
}

/// start(rows), which is the first red, then black, red, black, and the residual to the next level.
template <class Level, class Start>
void descend(Level& level, Level& coarse, Start&& start) {
  constexpr int kStages = 5;
  wavefront(
      level.nz, level.ny, level.strip(kStages), kStages, level.parallel,
      [&](int k) { return level.unknowns_of(k); },
      [&](int stage, int k, int first, int end) {
        const MultigridLevel::Rows rows{k, first, end};
        if (stage == 0) return start(rows);
        if (stage == kStages - 1) return level.restrict_residual(rows, coarse);
        level.relax(rows, stage % 2 == 1 ? Colour::kBlack : Colour::kRed, ahead_of_stage(stage));
      });
}

/// The correction, then black, red, black, red; finish(rows) where that is done.
template <class Level, class Finish>
void ascend(Level& level, const Level& coarse, Finish&& finish) {
  constexpr int kStages = 5;
  wavefront(
      level.nz, level.ny, level.strip(kStages), kStages, level.parallel,
      [&](int k) { return level.unknowns_of(k); },
      [&](int stage, int k, int first, int end) {
        const MultigridLevel::Rows rows{k, first, end};
        if (stage == 0) return level.prolong(rows, coarse);
        level.relax(rows, stage % 2 == 1 ? Colour::kBlack : Colour::kRed, ahead_of_stage(stage));
        if (stage == kStages - 1) finish(rows);
      });
}

}  // namespace archetide
