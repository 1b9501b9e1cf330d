#include <algorithm>
#include <numeric>

#include "common/base/exception_carrier.h"
#include "runtime/solid/block_cholesky.h"

namespace archetide {
namespace {

using Sparse = Eigen::SparseMatrix<double>;

/// L^-1 of a few columns that begin near each other: rows of the supernodes that they lead to, all
/// others are zero.
struct HalfSolution {
  std::vector<int> columns;     // of E
  std::vector<int> supernodes;  // ascending
  std::vector<long> row;        // where each begins, and the end
  MatX values;
};

/// Supernodes with a node of these columns, and all that follow them.
std::vector<int> reached(const FactorPattern& pattern, const Sparse& E,
                         const std::vector<int>& columns) {
  std::vector<int> found;
  std::vector<char> seen(pattern.supernodes().size(), 0);
  for (const int k : columns)
    for (Sparse::InnerIterator at(E, k); at; ++at) {
      int s = pattern.supernode(pattern.column(static_cast<int>(at.row()) / 3));
      for (; s >= 0 && !seen[s]; s = pattern.supernodes()[s].parent)
        seen[s] = 1, found.push_back(s);
    }
  std::sort(found.begin(), found.end());
  return found;
}

HalfSolution half_solve(const FactorPattern& pattern, const std::vector<MatX>& panels,
                        const Sparse& E, std::vector<int> columns) {
  HalfSolution z;
  z.columns = std::move(columns);
  z.supernodes = reached(pattern, E, z.columns);
  const auto width = static_cast<long>(z.columns.size());
  std::vector<long> begin(pattern.supernodes().size());
  z.row.push_back(0);
  for (const int s : z.supernodes) {
    begin[s] = z.row.back();
    z.row.push_back(begin[s] + 3L * pattern.supernodes()[s].width);
  }
  z.values = MatX::Zero(z.row.back(), width);
  const auto row_of = [&](int column) {
    const int s = pattern.supernode(column);
    return begin[s] + 3L * (column - pattern.supernodes()[s].first);
  };
  for (long k = 0; k < width; ++k)
    for (Sparse::InnerIterator at(E, z.columns[k]); at; ++at)
      z.values(row_of(pattern.column(static_cast<int>(at.row()) / 3)) + at.row() % 3, k) =
          at.value();
  MatX taken;
  for (const int k : z.supernodes) {
    const FactorPattern::Supernode& s = pattern.supernodes()[k];
    const long w = 3L * s.width, below = 3L * static_cast<long>(s.below.size());
    auto own = z.values.middleRows(begin[k], w);
    panels[k].topRows(w).triangularView<Eigen::Lower>().solveInPlace(own);
    taken.resize(below, width);
    taken.noalias() = panels[k].bottomRows(below) * own;
    for (std::size_t r = 0; r < s.below.size(); ++r)
      z.values.middleRows<3>(row_of(s.below[r])) -= taken.middleRows<3>(3L * static_cast<long>(r));
  }
  return z;
}

/// a^T b, over what both lead to.
MatX product(const HalfSolution& a, const HalfSolution& b) {
  MatX sum = MatX::Zero(a.values.cols(), b.values.cols());
  const std::size_t na = a.supernodes.size(), nb = b.supernodes.size();
  for (std::size_t i = 0, j = 0; i < na && j < nb;) {
    if (a.supernodes[i] < b.supernodes[j]) {
      ++i;
    } else if (b.supernodes[j] < a.supernodes[i]) {
      ++j;
    } else {  // as many as they have in a row
      std::size_t run = 1;
      while (i + run < na && j + run < nb && a.supernodes[i + run] == b.supernodes[j + run]) ++run;
      const long rows = a.row[i + run] - a.row[i];
      sum.noalias() +=
          a.values.middleRows(a.row[i], rows).transpose() * b.values.middleRows(b.row[j], rows);
      i += run, j += run;
    }
  }
  return sum;
}

}  // namespace

MatX BlockCholesky::compliance(const Sparse& E) const {
  constexpr std::size_t kAtOnce = 48;  // columns, whatever the number of threads
  const auto k = static_cast<std::size_t>(E.cols());
  std::vector<int> first(k, pattern_->size()), order(k);
  for (std::size_t c = 0; c < k; ++c)
    for (Sparse::InnerIterator at(E, static_cast<int>(c)); at; ++at)
      first[c] = std::min(first[c], pattern_->column(static_cast<int>(at.row()) / 3));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int p, int q) { return first[p] < first[q]; });

  const std::size_t parts = (k + kAtOnce - 1) / kAtOnce;
  std::vector<HalfSolution> z(parts);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (parts > 1)
  for (std::size_t p = 0; p < parts; ++p)
    carrier.run([&] {
      const auto begin = order.begin() + static_cast<long>(p * kAtOnce),
                 end = order.begin() + static_cast<long>(std::min((p + 1) * kAtOnce, k));
      z[p] = half_solve(*pattern_, panels_, E, {begin, end});
    });
  carrier.rethrow();
  MatX out(E.cols(), E.cols());
#pragma omp parallel for schedule(dynamic) if (parts > 1)
  for (std::size_t p = 0; p < parts; ++p)
    carrier.run([&] {
      for (std::size_t q = 0; q <= p; ++q) {
        const MatX block = product(z[p], z[q]);
        for (std::size_t i = 0; i < z[p].columns.size(); ++i)
          for (std::size_t j = 0; j < z[q].columns.size(); ++j)
            out(z[p].columns[i], z[q].columns[j]) = out(z[q].columns[j], z[p].columns[i]) =
                block(static_cast<long>(i), static_cast<long>(j));
      }
    });
  carrier.rethrow();
  return out;
}

}  // namespace archetide
