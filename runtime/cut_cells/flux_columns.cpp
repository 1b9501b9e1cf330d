#include "runtime/cut_cells/flux_columns.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace archetide {
namespace {

typedef double Eight __attribute__((vector_size(64)));
constexpr int kRows = 8;
// The cells of a body are far apart in memory: so many columns ahead they are fetched.
constexpr Eigen::Index kAhead = 16;

// The rows of a column in blocks. The last block may go on into the next column, which is long
// enough: two numbers of columns of six rows, at most seven of columns of nine and more.
template <int B>
struct Rows {
  Eight block[B];
  explicit Rows(const double* column) { std::memcpy(block, column, sizeof(block)); }
};

template <int B, class Place, class Value>
void gather(const MatX& columns, const std::vector<Place>& place, const Value* values, VecX& sum) {
  const Eigen::Index rows = columns.rows(), last = columns.cols() - 1;
  Eight total[B] = {};
  for (Eigen::Index m = 0; m < last; ++m) {
    __builtin_prefetch(values + place[std::min(m + kAhead, last)]);
    const Rows<B> column(columns.data() + m * rows);
    const double value = values[place[m]];
    for (int b = 0; b < B; ++b) total[b] += value * column.block[b];
  }
  double numbers[B * kRows];
  std::memcpy(numbers, total, sizeof(total));
  sum = Eigen::Map<const VecX>(numbers, rows);
  sum += static_cast<double>(values[place[last]]) * columns.col(last);
}

template <int B>
void scatter(const MatX& columns, const std::vector<std::int64_t>& place, Eigen::Index first,
             Eigen::Index end, const VecX& v, double* out) {
  const Eigen::Index rows = columns.rows(), last = columns.cols() - 1;
  double numbers[B * kRows] = {};
  std::memcpy(numbers, v.data(), static_cast<std::size_t>(rows) * sizeof(double));
  const Rows<B> factor(numbers);
  for (Eigen::Index m = first; m < std::min(end, last); ++m) {
    __builtin_prefetch(out + place[std::min(m + kAhead, last)], 1);
    const Rows<B> column(columns.data() + m * rows);
    Eight s = {};
    for (int b = 0; b < B; ++b) s += factor.block[b] * column.block[b];
    out[place[m]] += ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7]));
  }
  if (end > last) out[place[last]] += columns.col(last).dot(v);
}

// Calls f with the number of blocks as a constant; false where there are more than that.
template <class F>
bool in_blocks(const MatX& columns, const F& f) {
  switch ((columns.rows() + kRows - 1) / kRows) {
    case 1:
      f(std::integral_constant<int, 1>());
      return true;
    case 2:
      f(std::integral_constant<int, 2>());
      return true;
    case 3:
      f(std::integral_constant<int, 3>());
      return true;
    case 4:
      f(std::integral_constant<int, 4>());
      return true;
    default:
      return false;
  }
}

template <class Place, class Value>
VecX gather_any(const MatX& columns, const std::vector<Place>& place, const Value* values) {
  VecX sum = VecX::Zero(columns.rows());
  if (place.empty()) return sum;
  if (in_blocks(columns, [&](auto B) { gather<B>(columns, place, values, sum); })) return sum;
  for (std::size_t m = 0; m < place.size(); ++m)
    sum.noalias() +=
        static_cast<double>(values[place[m]]) * columns.col(static_cast<Eigen::Index>(m));
  return sum;
}

}  // namespace

VecX gather_columns(const MatX& columns, const std::vector<std::size_t>& place,
                    const float* values) {
  return gather_any(columns, place, values);
}
VecX gather_columns(const MatX& columns, const std::vector<std::int64_t>& place,
                    const double* values) {
  return gather_any(columns, place, values);
}

void scatter_columns(const MatX& columns, const std::vector<std::int64_t>& place, std::size_t first,
                     std::size_t end, const VecX& v, double* out) {
  if (first >= end) return;
  const auto from = static_cast<Eigen::Index>(first), to = static_cast<Eigen::Index>(end);
  if (in_blocks(columns, [&](auto B) { scatter<B>(columns, place, from, to, v, out); })) return;
  for (Eigen::Index m = from; m < to; ++m) out[place[m]] += columns.col(m).dot(v);
}

VecX sum_columns(const MatX& columns) {
  if (columns.cols() == 0) return VecX::Zero(columns.rows());
  return columns.rowwise().sum();
}

}  // namespace archetide
