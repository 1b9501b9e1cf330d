#include "runtime/numerics/vector_ops.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

using Range = Blocks::Range;

bool parallel(const Blocks& blocks) { return blocks.entries >= kParallelCells; }

template <class F>
void for_blocks(const Blocks& blocks, F&& f) {
  for_each_index(static_cast<int>(blocks.ranges.size()), parallel(blocks),
                 [&](int n) { f(blocks.ranges[n]); });
}

TwoSums operator+(const TwoSums& a, const TwoSums& b) {
  return {a.first + b.first, a.second + b.second};
}

// Partial results of all blocks, added in block order.
template <class T, class F>
T sum_blocks(const Blocks& blocks, F&& partial) {
  thread_local std::vector<T> parts;
  parts.assign(blocks.ranges.size(), T());
  std::vector<T>& shared = parts;  // the caller's copy, not each worker's
  for_each_index(static_cast<int>(blocks.ranges.size()), parallel(blocks),
                 [&](int n) { shared[n] = partial(blocks.ranges[n]); });
  T total = T();
  for (const T& part : shared) total = total + part;
  return total;
}

}  // namespace

Blocks all_blocks(std::size_t n) {
  Blocks blocks;
  blocks.add(0, n);
  return blocks;
}

void Blocks::add(std::size_t begin, std::size_t end) {
  for (std::size_t b = begin; b < end; b += kLength)
    ranges.push_back({b, std::min(b + kLength, end)});
  if (begin < end) entries += end - begin;
}

bool Blocks::holds(std::size_t entry) const {
  const auto after = std::ranges::upper_bound(ranges, entry, {}, &Range::begin);
  return after != ranges.begin() && entry < std::prev(after)->end;
}

double dot(const Blocks& blocks, const double* a, const double* b) {
  return sum_blocks<double>(blocks, [=](Range range) {
    double s = 0.0;
#pragma omp simd reduction(+ : s)
    for (std::size_t i = range.begin; i < range.end; ++i) s += a[i] * b[i];
    return s;
  });
}

double sum(const Blocks& blocks, const double* a) {
  return sum_blocks<double>(blocks, [=](Range range) {
    double s = 0.0;
#pragma omp simd reduction(+ : s)
    for (std::size_t i = range.begin; i < range.end; ++i) s += a[i];
    return s;
  });
}

double norm(const Blocks& blocks, const double* a) { return std::sqrt(dot(blocks, a, a)); }

double max_abs(const Blocks& blocks, const double* a) {
  struct Largest {
    double value = 0.0;
    bool nan = false;
    Largest operator+(const Largest& o) const { return {std::max(value, o.value), nan || o.nan}; }
  };
  const Largest largest = sum_blocks<Largest>(blocks, [=](Range range) {
    double m = 0.0;
    int nan = 0;
#pragma omp simd reduction(max : m) reduction(| : nan)
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const double v = std::abs(a[i]);
      m = v > m ? v : m;
      nan |= v != v;
    }
    return Largest{m, nan != 0};
  });
  return largest.nan ? std::nan("") : largest.value;
}

bool all_zero(const Blocks& blocks, const double* a) {
  return std::all_of(blocks.ranges.begin(), blocks.ranges.end(), [a](const Blocks::Range& range) {
    bool other = false;
    for (std::size_t n = range.begin; n < range.end; ++n) other |= a[n] != 0.0;
    return !other;
  });
}

void axpy(const Blocks& blocks, double s, const double* x, double* y) {
  for_blocks(blocks, [=](Range range) {
#pragma omp simd
    for (std::size_t i = range.begin; i < range.end; ++i) y[i] += s * x[i];
  });
}

void xpay(const Blocks& blocks, const double* x, double s, double* y) {
  for_blocks(blocks, [=](Range range) {
#pragma omp simd
    for (std::size_t i = range.begin; i < range.end; ++i) y[i] = x[i] + s * y[i];
  });
}

void copy(const Blocks& blocks, const double* x, double* y) {
  for_blocks(blocks,
             [=](Range range) { std::copy(x + range.begin, x + range.end, y + range.begin); });
}

void fill(const Blocks& blocks, double value, double* y) {
  for_blocks(blocks, [=](Range range) { std::fill(y + range.begin, y + range.end, value); });
}

void subtract_from(const Blocks& blocks, const double* b, double* y) {
  for_blocks(blocks, [=](Range range) {
#pragma omp simd
    for (std::size_t i = range.begin; i < range.end; ++i) y[i] = b[i] - y[i];
  });
}

TwoSums dot_two(const Blocks& blocks, const double* a, const double* b, const double* c) {
  return sum_blocks<TwoSums>(blocks, [=](Range range) {
    double s = 0.0, t = 0.0;
#pragma omp simd reduction(+ : s, t)
    for (std::size_t i = range.begin; i < range.end; ++i) {
      s += a[i] * b[i];
      t += a[i] * c[i];
    }
    return TwoSums{s, t};
  });
}

double step_and_dot(const Blocks& blocks, double s, const double* p, const double* q, double* x,
                    double* r) {
  return sum_blocks<double>(blocks, [=](Range range) {
    double rr = 0.0;
#pragma omp simd reduction(+ : rr)
    for (std::size_t i = range.begin; i < range.end; ++i) {
      x[i] += s * p[i];
      const double ri = r[i] - s * q[i];
      r[i] = ri;
      rr += ri * ri;
    }
    return rr;
  });
}

}  // namespace archetide
