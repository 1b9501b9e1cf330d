#pragma once

#include <cstddef>
#include <vector>

namespace archetide {

/// Fixed contiguous pieces of a vector. Every operation below works piece by piece and adds sums in
/// piece order, so a result does not depend on the number of threads.
struct Blocks {
  struct Range {
    std::size_t begin, end;
  };
  static constexpr std::size_t kLength = 16384;  // longest piece
  std::vector<Range> ranges;                     // ascending, disjoint
  std::size_t entries = 0;                       // sum of the lengths

  void clear() { ranges.clear(), entries = 0; }
  /// Appends [begin, end), cut to kLength.
  void add(std::size_t begin, std::size_t end);
  bool holds(std::size_t entry) const;
};

/// All n entries.
Blocks all_blocks(std::size_t n);

/// sum a_i b_i   (2n reads)
double dot(const Blocks& blocks, const double* a, const double* b);
/// sum a_i
double sum(const Blocks& blocks, const double* a);
/// |a|_2
double norm(const Blocks& blocks, const double* a);
/// max |a_i|, NaN when an entry is NaN
double max_abs(const Blocks& blocks, const double* a);
/// Whether every entry is 0; ends at the first piece that has another.
bool all_zero(const Blocks& blocks, const double* a);
/// y = y + s x   (2n reads, n writes)
void axpy(const Blocks& blocks, double s, const double* x, double* y);
/// y = x + s y   (2n reads, n writes)
void xpay(const Blocks& blocks, const double* x, double s, double* y);
/// y = x
void copy(const Blocks& blocks, const double* x, double* y);
/// y = value
void fill(const Blocks& blocks, double value, double* y);
/// y = b - y   (2n reads, n writes)
void subtract_from(const Blocks& blocks, const double* b, double* y);

/// The two sums of one pass: a.b and a.c   (3n reads)
struct TwoSums {
  double first, second;
};
TwoSums dot_two(const Blocks& blocks, const double* a, const double* b, const double* c);
/// x += s p, r -= s q, returns r.r   (4n reads, 2n writes)
double step_and_dot(const Blocks& blocks, double s, const double* p, const double* q, double* x,
                    double* r);

}  // namespace archetide
