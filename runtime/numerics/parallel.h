#pragma once

#include <omp.h>

#include <algorithm>
#include <cstddef>
#include <vector>

#include "common/base/exception_carrier.h"

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
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic, 4)
  for (int i = 0; i < n; ++i) carrier.run([&] { f(i); });
  carrier.rethrow();
}

/// f(0) .. f(n - 1), each work for all threads: shared among them if there are as many, else one
/// after another, so that the loops inside have all threads. (In a parallel region of one thread
/// theirs would be made and ended for every loop.)
template <class F>
void for_each_large(std::size_t n, F&& f) {
  if (n < static_cast<std::size_t>(omp_get_max_threads())) {
    for (std::size_t i = 0; i < n; ++i) f(i);
    return;
  }
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t i = 0; i < n; ++i) carrier.run([&] { f(i); });
  carrier.rethrow();
}

/// Rows of a strip (even) so that the planes that a wavefront of `stages` works on stay in a cache
/// of half a megabyte, at row_bytes a row of all arrays together.
inline int strip_rows(int stages, std::size_t row_bytes) {
  constexpr std::size_t kCache = 512 * 1024;
  return std::max(8, static_cast<int>(kCache / ((stages + 2) * row_bytes)) & ~1);
}

/// Limits (even, slabs + 1) of slabs of at least `narrowest` (even) planes that share work(plane)
/// evenly: most of a box may be air.
template <class Work>
std::vector<int> slab_limits(int planes, int slabs, int narrowest, const Work& work) {
  std::size_t total = 0, done = 0;
  for (int k = 0; k < planes; ++k) total += work(k);
  std::vector<int> limits(slabs + 1, planes);
  int k = limits[0] = 0;
  for (int s = 1; s < slabs; ++s) {
    const int first = limits[s - 1] + narrowest, last = (planes & ~1) - narrowest * (slabs - s);
    while (k < last && (k < first || k % 2 != 0 || done * slabs < total * s)) done += work(k++);
    limits[s] = k;
  }
  return limits;
}

/// Stages 0 .. stages - 1 on `rows` rows of `planes` planes, as stage(s, plane, first row, end
/// row), where stage s of a row needs stage s - 1 of the row and of its neighbours in the plane and
/// in both planes beside it. Stages follow each other one plane apart on strips of `strip` rows
/// (even), so that rows are still in cache when their next stage comes; a stage's strip begins one
/// row before that of the stage before. With threads, each owns a slab: first the part of the slab
/// that depends on nothing outside, then, after a barrier, the wedges around the slab limits (which
/// are even). Slabs share work(plane), say its unknowns.
template <class Work, class F>
void wavefront(int planes, int rows, int strip, int stages, bool parallel, const Work& work,
               F&& stage) {
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
  const int narrowest = 3 * stages & ~1;  // wedges of stages - 1 planes to both sides stay apart
  const int slabs = parallel ? std::min(omp_get_max_threads(), planes / narrowest) : 1;
  if (slabs <= 1) {
    sweep(0, planes, 0, 0);
    return;
  }
  const std::vector<int> limit = slab_limits(planes, slabs, narrowest, work);
#pragma omp parallel num_threads(slabs)
  {
#pragma omp for schedule(static)
    for (int slab = 0; slab < slabs; ++slab)
      sweep(limit[slab], limit[slab + 1], slab > 0 ? 1 : 0, slab + 1 < slabs ? -1 : 0);
#pragma omp for schedule(static)
    for (int slab = 1; slab < slabs; ++slab)
      for (int s = 1; s < stages; ++s)
        for (int k = limit[slab] - s; k < limit[slab] + s; ++k)
          for (int j = 0; j < rows; j += strip) strip_stage(s, k, j);
  }
}

}  // namespace archetide
