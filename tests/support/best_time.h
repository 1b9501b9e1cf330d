#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>

namespace archetide {

/// Wall microseconds each of `times` runs of work(times), the best of several batches.
template <class Work>
double best_microseconds(int times, const Work& work) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 20;
  double best = INFINITY;
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto start = Clock::now();
    work(times);
    best = std::min(
        best, std::chrono::duration<double, std::micro>(Clock::now() - start).count() / times);
  }
  return best;
}

}  // namespace archetide
