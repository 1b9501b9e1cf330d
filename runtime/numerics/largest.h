#pragma once

#include <algorithm>
#include <cstddef>

namespace archetide {

/// Largest of value(0), ..., value(count - 1), none of them negative; 0 if there are none. `value` is
/// called on all threads. (`parallel for simd reduction(max)` over all of them at once is wrong in
/// clang 14.)
template <class F>
double largest_of(std::size_t count, F&& value) {
  constexpr std::size_t kPortion = 1024;
  double largest = 0.0;
#pragma omp parallel for schedule(static) reduction(max : largest)
  for (std::size_t first = 0; first < count; first += kPortion) {
    const std::size_t end = std::min(first + kPortion, count);
    double most = 0.0;
#pragma omp simd reduction(max : most)
    for (std::size_t n = first; n < end; ++n) {
      const double v = value(n);
      most = v > most ? v : most;
    }
    largest = std::max(largest, most);
  }
  return largest;
}

}  // namespace archetide
