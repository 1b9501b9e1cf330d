#pragma once

#include <omp.h>

#include <algorithm>
#include <cstddef>

namespace archetide {

/// Work on fewer cells than this runs on one thread: starting threads would cost more than they
/// save.
inline constexpr std::size_t kParallelCells = 48 * 48 * 48;

/// f(0) .. f(n - 1) in any order, each exactly once. In small portions: often the planes of a tank,
/// of which those above the water are soon done.
template <class F>
void for_each_index(int n, bool parallel, F&& f) {
  if (!parallel) {
    for (int i = 0; i < n; ++i) f(i);
    return;
  }
#pragma omp parallel for schedule(dynamic, 4)
  for (int i = 0; i < n; ++i) f(i);
}

/// Rows of a strip (even) so that the planes that a wavefront of `stages` works on stay in a cache
/// of half a megabyte, at row_bytes a row of all arrays together.
inline int strip_rows(int stages, std::size_t row_bytes) {
  constexpr std::size_t kCache = 512 * 1024;
  return std::max(8, static_cast<int>(kCache / ((stages + 2) * row_bytes)) & ~1);
}

/// Stages 0 .. stages - 1 on `rows` rows of `planes` planes, as stage(s, plane, first row, end
/// row), where stage s of a row needs stage s - 1 of the row and of its neighbours in the plane and
/// in both planes beside it. Stages follow each other one plane apart on strips of `strip` rows
/// (even), so that rows are still in cache when their next stage comes; a stage's strip begins one
/// row before that of the stage before. With threads, each owns a slab: first the part of the slab
/// that depends on nothing outside, then, after a barrier, the wedges around the slab limits (which
/// are even).
template <class F>
void wavefront(int planes, int rows, int strip, int stages, bool parallel, F&& stage) {
  // Stage s of the strip that begins with row j; the same rows whoever works on them.
  const auto strip_stage = [&](int s, int k, int j) {
    const int first = j == 0 ? 0 : j - s, last = j + strip >= rows ? rows : j + strip - s;
    if (first < last) stage(s, k, first, last);
  };
  const auto sweep = [&](int begin, int end, int grow_low, int grow_high) {
    // Stage s runs on planes [begin + s grow_low, end + s grow_high).
    for (int j = 0; j < rows; j += strip)
      for (int front = begin; front < end + stages; ++front)
        for (int s = 0; s < stages; ++s) {
          const int k = front - s;
          if (k >= begin + s * grow_low && k < end + s * grow_high) strip_stage(s, k, j);
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
        for (int k = limit(slab) - s; k < limit(slab) + s; ++k)
          for (int j = 0; j < rows; j += strip) strip_stage(s, k, j);
  }
}

}  // namespace archetide
