#include "runtime/solid/block_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <numeric>

#include "common/base/check.h"
#include "common/base/exception_carrier.h"

namespace archetide {
namespace {

using Supernode = FactorPattern::Supernode;

/// Children before parents, in the order of the children.
std::vector<int> postorder(const std::vector<int>& parent) {
  const auto n = static_cast<int>(parent.size());
  std::vector<int> first(n, -1), next(n, -1), order, stack;
  for (int j = n - 1; j >= 0; --j)
    if (parent[j] >= 0) next[j] = first[parent[j]], first[parent[j]] = j;
  for (int root = 0; root < n; ++root) {
    if (parent[root] >= 0) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const int j = stack.back(), child = first[j];
      if (child >= 0) {
        first[j] = next[child];
        stack.push_back(child);
      } else {
        order.push_back(j);
        stack.pop_back();
      }
    }
  }
  return order;
}

/// Both lists ascending.
std::vector<int> united(const std::vector<int>& a, const std::vector<int>& b) {
  std::vector<int> sum;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(sum));
  return sum;
}

/// Blocks of a supernode's columns on and below the diagonal.
double blocks_of(double width, double rows) { return width * (rows - 0.5 * (width - 1.0)); }

}  // namespace

FactorPattern::FactorPattern(const TetMatrices& m) {
  number_columns(m, m.order);
  const std::vector<int> order = postorder(elimination_tree());
  std::vector<int> nodes;
  for (const int column : order) nodes.push_back(node_[static_cast<std::size_t>(column)]);
  number_columns(m, nodes);
  find_supernodes();
  merge_supernodes();
}

void FactorPattern::number_columns(const TetMatrices& m, const std::vector<int>& order) {
  node_ = order;
  column_.resize(order.size());
  for (std::size_t c = 0; c < order.size(); ++c) column_[order[c]] = static_cast<int>(c);
  entries_.assign(order.size(), {});
  for (int p = 0; p < size(); ++p)
    for (int e = m.row_begin(p); e < m.row_end(p); ++e) {
      const int row = column_[p], col = column_[m.column[e]];
      entries_[std::min(row, col)].push_back({std::max(row, col), e, row < col});
    }
  for (std::vector<Entry>& list : entries_)
    std::sort(list.begin(), list.end(),
              [](const Entry& a, const Entry& b) { return a.row < b.row; });
}

/// Parent of each column [Liu90]: the first row below it in the factor.
std::vector<int> FactorPattern::elimination_tree() const {
  const int n = size();
  std::vector<std::vector<int>> left(n);  // of each row, columns with an entry in it
  for (int c = 0; c < n; ++c)
    for (const Entry& e : entries_[c])
      if (e.row > c) left[e.row].push_back(c);
  std::vector<int> parent(n, -1), root(n, -1);
  for (int row = 0; row < n; ++row)
    for (int c : left[row])
      while (c >= 0 && c != row) {
        const int up = root[c];
        root[c] = row;
        if (up < 0) parent[c] = row;
        c = up;
      }
  return parent;
}

/// Rows of the factor column by column; a column that continues the one before joins it.
void FactorPattern::find_supernodes() {
  const int n = size();
  std::vector<std::vector<int>> given(n);  // rows that the children of a column leave it
  std::vector<int> of_column(n, -1);
  for (int c = 0; c < n; ++c) {
    std::vector<int> rows;
    for (const Entry& e : entries_[c]) rows.push_back(e.row);
    rows = united(rows, given[c]);
    given[c] = {};
    const std::vector<int> below(rows.begin() + 1, rows.end());
    Supernode* last = supernodes_.empty() ? nullptr : &supernodes_.back();
    if (last && !last->below.empty() && last->below.front() == c &&
        last->below.size() == rows.size()) {
      ++last->width;
      last->below = below;
    } else {
      supernodes_.push_back({c, 1, below, -1});
    }
    of_column[c] = static_cast<int>(supernodes_.size()) - 1;
    if (!below.empty()) given[below.front()] = united(given[below.front()], below);
  }
  for (Supernode& s : supernodes_)
    if (!s.below.empty()) s.parent = of_column[s.below.front()];
}

/// Small fronts cost more to begin than to multiply: a supernode joins the parent that follows it
/// where few zeros come in.
void FactorPattern::merge_supernodes() {
  constexpr int kAlways = 8;       // columns that are merged at any price
  constexpr double kZeros = 0.15;  // of the blocks of the whole
  std::vector<Supernode> merged;
  std::vector<double> own;  // blocks that are not zero
  for (const Supernode& s : supernodes_) {
    merged.push_back(s);
    own.push_back(blocks_of(s.width, s.rows()));
    while (merged.size() > 1) {
      Supernode &child = merged[merged.size() - 2], &parent = merged.back();
      if (child.below.empty() || child.below.front() < parent.first ||
          child.below.front() >= parent.first + parent.width)
        break;
      const double blocks = own[own.size() - 2] + own.back();
      const int width = child.width + parent.width;
      const double whole = blocks_of(width, child.width + parent.rows());
      if (width > kAlways && whole - blocks > kZeros * whole) break;
      parent.first = child.first, parent.width = width;
      merged.erase(merged.end() - 2);
      own.pop_back();
      own.back() = blocks;
    }
  }
  supernode_.resize(column_.size());
  for (std::size_t s = 0; s < merged.size(); ++s)
    for (int c = 0; c < merged[s].width; ++c) supernode_[merged[s].first + c] = static_cast<int>(s);
  for (Supernode& s : merged) s.parent = s.below.empty() ? -1 : supernode_[s.below.front()];
  supernodes_ = std::move(merged);
}

std::size_t FactorPattern::factor_bytes() const {
  std::size_t sum = 0;
  for (const Supernode& s : supernodes_)
    sum += 9 * sizeof(double) * static_cast<std::size_t>(s.width) *
           static_cast<std::size_t>(s.rows());
  return sum;
}

namespace {

/// What a supernode leaves for those after it: an update of its rows below.
struct Update {
  int supernode = -1;
  MatX of_rows;  // 3 below x 3 below, lower triangle
};

/// The front of a supernode as it is assembled: rows and columns of `s`, lower triangle.
class Front {
 public:
  Front(const FactorPattern& pattern, const Supernode& s, std::vector<int>& place)
      : pattern_(pattern), s_(s), place_(place), values_(MatX::Zero(3L * s.rows(), 3L * s.rows())) {
    for (int c = 0; c < s.width; ++c) place_[s.first + c] = c;
    for (std::size_t r = 0; r < s.below.size(); ++r)
      place_[s.below[r]] = s.width + static_cast<int>(r);
  }

  void add_matrix(const TetMatrices& m, const std::vector<Mat3>& K, double ratio) {
    for (int c = 0; c < s_.width; ++c)
      for (const FactorPattern::Entry& e : pattern_.entries(s_.first + c)) {
        Mat3 block = ratio * K[e.block];
        if (e.transpose) block.transposeInPlace();
        block.diagonal().array() += m.mass[e.block];
        values_.block<3, 3>(3L * place_[e.row], 3L * c) += block;
      }
  }
  void add_update(const Supernode& child, const MatX& update) {
    const auto n = static_cast<long>(child.below.size());
    for (long c = 0; c < n; ++c) {
      const long to = 3L * place_[child.below[c]];
      for (long r = c; r < n; ++r)
        values_.block<3, 3>(3L * place_[child.below[r]], to) += update.block<3, 3>(3 * r, 3 * c);
    }
  }
  /// L of the supernode's columns; what is left is its update. Empty where it is not definite.
  MatX factor(MatX& update) {
    const long w = 3L * s_.width, b = values_.rows() - w;
    auto pivot = values_.topLeftCorner(w, w);
    const Eigen::LLT<Eigen::Ref<MatX>> llt(pivot);
    if (llt.info() != Eigen::Success) return {};
    auto below = values_.bottomLeftCorner(b, w);
    pivot.transpose().triangularView<Eigen::Upper>().solveInPlace<Eigen::OnTheRight>(below);
    update = values_.bottomRightCorner(b, b);
    update.selfadjointView<Eigen::Lower>().rankUpdate(below, -1.0);
    return values_.leftCols(w);
  }

 private:
  const FactorPattern& pattern_;
  const Supernode& s_;
  std::vector<int>& place_;  // of a row of the matrix in the front
  MatX values_;
};

// A few right-hand sides: the factor is read once for all of them, kTile of its columns and kStrip
// of its rows at a time. (Products of matrices would first copy it: with 4 columns that took more
// time than all else.)
constexpr Eigen::Index kFew = 8, kTile = 4, kStrip = 128;

// F: a column for each right-hand side of a panel's rows; those of its own columns are solved for,
// and what they take of the rows below is added to them.
void forward_few(const MatX& panel, Eigen::Index w, MatX& F) {
  const Eigen::Index rows = panel.rows();
  for (Eigen::Index j = 0; j < w; j += kTile) {
    const Eigen::Index tile = std::min(kTile, w - j), below = j + tile;
    for (Eigen::Index c = 0; c < F.cols(); ++c)
      for (Eigen::Index i = j; i < below; ++i) {
        const double y = F(i, c) /= panel(i, i);
        for (Eigen::Index r = i + 1; r < below; ++r) F(r, c) -= panel(r, i) * y;
      }
    for (Eigen::Index first = below; first < rows; first += kStrip) {
      const Eigen::Index last = std::min(first + kStrip, rows);
      for (Eigen::Index c = 0; c < F.cols(); ++c) {
        double* f = F.col(c).data();
        if (tile == kTile) {
          const double *l0 = panel.col(j).data(), *l1 = panel.col(j + 1).data(),
                       *l2 = panel.col(j + 2).data(), *l3 = panel.col(j + 3).data();
          const double y0 = f[j], y1 = f[j + 1], y2 = f[j + 2], y3 = f[j + 3];
#pragma omp simd
          for (Eigen::Index r = first; r < last; ++r)
            f[r] -= l0[r] * y0 + l1[r] * y1 + l2[r] * y2 + l3[r] * y3;
          continue;
        }
        for (Eigen::Index i = j; i < below; ++i) {
          const double *l = panel.col(i).data(), y = f[i];
#pragma omp simd
          for (Eigen::Index r = first; r < last; ++r) f[r] -= l[r] * y;
        }
      }
    }
  }
}

// The transpose: the rows below are known.
void backward_few(const MatX& panel, Eigen::Index w, MatX& F) {
  const Eigen::Index rows = panel.rows();
  for (Eigen::Index below = w; below > 0;) {
    const Eigen::Index tile = below % kTile == 0 ? kTile : below % kTile, j = below - tile;
    Eigen::Matrix<double, kTile, kFew> sums = Eigen::Matrix<double, kTile, kFew>::Zero();
    for (Eigen::Index first = below; first < rows; first += kStrip) {
      const Eigen::Index last = std::min(first + kStrip, rows);
      for (Eigen::Index c = 0; c < F.cols(); ++c) {
        const double* f = F.col(c).data();
        if (tile == kTile) {
          const double *l0 = panel.col(j).data(), *l1 = panel.col(j + 1).data(),
                       *l2 = panel.col(j + 2).data(), *l3 = panel.col(j + 3).data();
          double s0 = 0.0, s1 = 0.0, s2 = 0.0, s3 = 0.0;
#pragma omp simd reduction(+ : s0, s1, s2, s3)
          for (Eigen::Index r = first; r < last; ++r)
            s0 += l0[r] * f[r], s1 += l1[r] * f[r], s2 += l2[r] * f[r], s3 += l3[r] * f[r];
          sums.col(c) += Eigen::Vector4d(s0, s1, s2, s3);
          continue;
        }
        for (Eigen::Index i = 0; i < tile; ++i) {
          const double* l = panel.col(j + i).data();
          double s = 0.0;
#pragma omp simd reduction(+ : s)
          for (Eigen::Index r = first; r < last; ++r) s += l[r] * f[r];
          sums(i, c) += s;
        }
      }
    }
    for (Eigen::Index c = 0; c < F.cols(); ++c)
      for (Eigen::Index i = below; i-- > j;) {
        double y = F(i, c) - sums(i - j, c);
        for (Eigen::Index r = i + 1; r < below; ++r) y -= panel(r, i) * F(r, c);
        F(i, c) = y / panel(i, i);
      }
    below = j;
  }
}

// Both, of a few right-hand sides x in the order of columns.
void solve_few(const std::vector<Supernode>& supernodes, const std::vector<MatX>& panels, MatX& x) {
  MatX front;                                            // rows of a supernode, its own first
  for (std::size_t k = 0; k < supernodes.size(); ++k) {  // L y = b
    const Supernode& s = supernodes[k];
    const long w = 3L * s.width;
    front.setZero(3L * s.rows(), x.cols());
    front.topRows(w) = x.middleRows(3L * s.first, w);
    forward_few(panels[k], w, front);
    x.middleRows(3L * s.first, w) = front.topRows(w);
    for (std::size_t r = 0; r < s.below.size(); ++r)
      x.middleRows<3>(3L * s.below[r]) += front.middleRows<3>(w + 3L * static_cast<long>(r));
  }
  for (std::size_t k = supernodes.size(); k-- > 0;) {  // L^T x = y
    const Supernode& s = supernodes[k];
    const long w = 3L * s.width;
    front.resize(3L * s.rows(), x.cols());
    front.topRows(w) = x.middleRows(3L * s.first, w);
    for (std::size_t r = 0; r < s.below.size(); ++r)
      front.middleRows<3>(w + 3L * static_cast<long>(r)) = x.middleRows<3>(3L * s.below[r]);
    backward_few(panels[k], w, front);
    x.middleRows(3L * s.first, w) = front.topRows(w);
  }
}

}  // namespace

BlockCholesky::BlockCholesky(std::shared_ptr<const FactorPattern> pattern,
                             const TetMatrices& matrices, double ratio)
    : BlockCholesky(std::move(pattern)) {
  ARCHETIDE_CHECK(factor(matrices, matrices.stiffness, ratio));
}

std::shared_ptr<const BlockCholesky> BlockCholesky::if_definite(
    std::shared_ptr<const FactorPattern> pattern, const TetMatrices& matrices,
    const std::vector<Mat3>& K, double ratio) {
  const std::shared_ptr<BlockCholesky> made(new BlockCholesky(std::move(pattern)));
  return made->factor(matrices, K, ratio) ? made : nullptr;
}

bool BlockCholesky::factor(const TetMatrices& matrices, const std::vector<Mat3>& K, double ratio) {
  const std::vector<Supernode>& supernodes = pattern_->supernodes();
  std::vector<int> place(pattern_->size());
  std::vector<Update> open;  // children stand last: columns are in postorder
  panels_.reserve(supernodes.size());
  for (std::size_t n = 0; n < supernodes.size(); ++n) {
    const Supernode& s = supernodes[n];
    Front front(*pattern_, s, place);
    front.add_matrix(matrices, K, ratio);
    while (!open.empty() && supernodes[open.back().supernode].parent == static_cast<int>(n)) {
      front.add_update(supernodes[open.back().supernode], open.back().of_rows);
      open.pop_back();
    }
    MatX update;
    panels_.push_back(front.factor(update));
    if (panels_.back().size() == 0) return false;
    if (s.parent >= 0) open.push_back({static_cast<int>(n), std::move(update)});
  }
  return true;
}

void BlockCholesky::solve_some(Eigen::Ref<MatX> b) const {
  const int n = pattern_->size();
  MatX x(3L * n, b.cols());
  for (int c = 0; c < n; ++c) x.middleRows<3>(3L * c) = b.middleRows<3>(3L * pattern_->node(c));
  const std::vector<Supernode>& supernodes = pattern_->supernodes();
  if (b.cols() <= kFew) {
    solve_few(supernodes, panels_, x);
    for (int c = 0; c < n; ++c) b.middleRows<3>(3L * pattern_->node(c)) = x.middleRows<3>(3L * c);
    return;
  }
  MatX rows;
  const auto each_row = [&](const Supernode& s, const auto& visit) {
    for (std::size_t r = 0; r < s.below.size(); ++r)
      visit(rows.middleRows<3>(3L * static_cast<long>(r)), x.middleRows<3>(3L * s.below[r]));
  };
  for (std::size_t k = 0; k < supernodes.size(); ++k) {  // L y = b
    const Supernode& s = supernodes[k];
    const long w = 3L * s.width, below = 3L * static_cast<long>(s.below.size());
    auto own = x.middleRows(3L * s.first, w);
    panels_[k].topRows(w).triangularView<Eigen::Lower>().solveInPlace(own);
    rows.resize(below, b.cols());
    rows.noalias() = panels_[k].bottomRows(below) * own;
    each_row(s, [](auto&& of_front, auto&& of_x) { of_x -= of_front; });
  }
  for (std::size_t k = supernodes.size(); k-- > 0;) {  // L^T x = y
    const Supernode& s = supernodes[k];
    const long w = 3L * s.width, below = 3L * static_cast<long>(s.below.size());
    auto own = x.middleRows(3L * s.first, w);
    rows.resize(below, b.cols());
    each_row(s, [](auto&& of_front, auto&& of_x) { of_front = of_x; });
    own.noalias() -= panels_[k].bottomRows(below).transpose() * rows;
    panels_[k].topRows(w).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
  }
  for (int c = 0; c < n; ++c) b.middleRows<3>(3L * pattern_->node(c)) = x.middleRows<3>(3L * c);
}

void BlockCholesky::solve(MatX& b) const {
  constexpr Eigen::Index kAtOnce = 16;  // columns, whatever the number of threads
  const Eigen::Index parts = (b.cols() + kAtOnce - 1) / kAtOnce;
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (parts > 1)
  for (Eigen::Index p = 0; p < parts; ++p)
    carrier.run([&] {
      const Eigen::Index first = p * kAtOnce;
      solve_some(b.middleCols(first, std::min(kAtOnce, b.cols() - first)));
    });
  carrier.rethrow();
}

}  // namespace archetide
