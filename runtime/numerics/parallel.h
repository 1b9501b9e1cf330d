#pragma once

#include <omp.h>

#include <algorithm>
#include <cstddef>

namespace archetide {

/// Work on fewer cells than this runs on one thread: starting threads would cost more than they
/// save.
inline constexpr std::size_t kParallelCells = 48 * 48 * 48;

/// f(0) .. f(n - 1) in any order, each exactly once.
template <class F>
void for_each_index(int n, bool parallel, F&& f) {
  if (!parallel) {
    for (int i = 0; i < n; ++i) f(i);
    return;
  }
#pragma omp parallel for schedule(static)
  for (int i = 0; i < n; ++i) f(i);
}

/// Stages 0 .. stages - 1 on planes 0 .. planes - 1, where stage s of a plane needs stage s - 1 of
/// the plane and of both its neighbours. Stages follow each other two planes apart, so that a plane
/// is still in cache when its next stage comes. With threads, each owns a slab: first the part of
/// the slab that depends on nothing outside, then, after a barrier, the wedges around the slab
/// limits (which are even).
template <class F>
void wavefront(int planes, int stages, bool parallel, F&& stage) {
  const auto sweep = [&](int begin, int end, int grow_low, int grow_high) {
    // Stage s runs on [begin + s grow_low, end + s grow_high).
    for (int front = begin; front < end + stages; ++front)
      for (int s = 0; s < stages; ++s) {
        const int k = front - s;
        if (k >= begin + s * grow_low && k < end + s * grow_high) stage(s, k);
      }
  };
  const int slabs = parallel ? std::min(omp_get_max_threads(), planes / (3 * stages)) : 1;
  if (slabs <= 1) {
    sweep(0, planes, 0, 0);
    return;
  }
  const auto limit = [&](int slab) {
    return slab == slabs ? planes : static_cast<int>(2LL * (planes / 2) * slab / slabs) & ~1;
  };
#pragma omp parallel num_threads(slabs)
  {
#pragma omp for schedule(static)
    for (int slab = 0; slab < slabs; ++slab)
      sweep(limit(slab), limit(slab + 1), slab > 0 ? 1 : 0, slab + 1 < slabs ? -1 : 0);
#pragma omp for schedule(static)
    for (int slab = 1; slab < slabs; ++slab)
      for (int s = 1; s < stages; ++s)
        for (int k = limit(slab) - s; k < limit(slab) + s; ++k) stage(s, k);
  }
}

}  // namespace archetide
