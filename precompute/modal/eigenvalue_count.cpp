// Counts eigenvalues by a left-looking supernodal factorisation A = L J L^T, J = diag(+-1): the
// Cholesky factorisation with a sign for each column, on the supernodes and the fill of CHOLMOD's
// analysis (Sylvester: as many negative signs as negative eigenvalues). There is no pivoting: a
// pivot that all but cancels is reported and the caller takes another shift.

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "precompute/modal/cholmod_view.h"
#include "precompute/modal/eigen_solver.h"
#include "precompute/modal/ordering.h"

extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b,
            const int* ldb);
void dgemm_(const char* transa, const char* transb, const int* m, const int* n, const int* k,
            const double* alpha, const double* a, const int* lda, const double* b, const int* ldb,
            const double* beta, double* c, const int* ldc);
}

namespace archetide {
namespace {

const double kOne = 1.0, kMinusOne = -1.0, kZero = 0.0;

/// A pivot smaller than this, relative to the diagonal it started from, would amplify round-off to
/// 1e-16 / kSmallPivot of the stiffness, too near to the gap in which the shift lies.
constexpr double kSmallPivot = 1e-6;
constexpr int kPanel = 64;  // columns that are factored by plain loops where a sign is negative

/// Supernodes in postorder: supernode k owns columns first[k] .. first[k + 1] of the permuted
/// matrix; rows[k] are its row indices, its own columns first.
struct Supernodes {
  std::vector<int> permutation;  // position -> dof
  std::vector<int> first;
  std::vector<std::vector<int>> rows;
  std::vector<int> owner;  // column -> supernode
};

Supernodes supernodes(const SparseMatrix& matrix, const std::vector<int>& ordering) {
  CholmodCommon cholmod;
  cholmod_sparse view = cholmod_view(matrix);
  cholmod_factor* L =
      cholmod_analyze_p(&view, const_cast<int*>(ordering.data()), nullptr, 0, &cholmod.common);
  cholmod.require(L, "analysing the stiffness");
  const int count = int(L->nsuper);
  const int *super = static_cast<int*>(L->super), *pi = static_cast<int*>(L->pi),
            *s = static_cast<int*>(L->s), *perm = static_cast<int*>(L->Perm);
  Supernodes result;
  result.permutation.assign(perm, perm + L->n);
  result.first.assign(super, super + count + 1);
  result.owner.resize(L->n);
  for (int k = 0; k < count; ++k) {
    std::fill(result.owner.begin() + super[k], result.owner.begin() + super[k + 1], k);
    result.rows.emplace_back(s + pi[k], s + pi[k + 1]);
  }
  cholmod_free_factor(&L, &cholmod.common);
  return result;
}

/// Columns of L of one supernode, rows x columns, column major, and their signs.
struct Block {
  int rows = 0, columns = 0;
  std::vector<double> values;
  std::vector<signed char> sign;
  bool mixed = false;  // some sign is negative

  double* at(int row, int column) { return values.data() + row + std::ptrdiff_t(column) * rows; }
};

class SignedCholesky {
 public:
  SignedCholesky(const SparseMatrix& matrix, const std::vector<int>& ordering)
      : matrix_(matrix), tree_(supernodes(matrix, ordering)), position_(matrix.rows()) {
    const int n = int(matrix.rows()), count = int(tree_.rows.size());
    for (int i = 0; i < n; ++i) position_[tree_.permutation[i]] = i;
    place_.resize(n);
    blocks_.resize(count);
    next_.assign(count, -1);
    updates_.assign(count, -1);
    done_.assign(count, 0);
  }

  /// The number of negative signs; -1 when a pivot all but vanished.
  int count_negative() {
    int negative = 0;
    for (int k = 0; k < int(blocks_.size()); ++k) {
      assemble(k);
      update(k);
      if (!factor(blocks_[k])) return -1;
      negative += int(std::count(blocks_[k].sign.begin(), blocks_[k].sign.end(), -1));
      done_[k] = blocks_[k].columns;
      queue(k);
    }
    return negative;
  }

 private:
  /// The matrix entries of the supernode's columns.
  void assemble(int k) {
    const std::vector<int>& rows = tree_.rows[k];
    Block& b = blocks_[k];
    b.rows = int(rows.size());
    b.columns = tree_.first[k + 1] - tree_.first[k];
    b.values.assign(std::size_t(b.rows) * b.columns, 0.0);
    b.sign.assign(b.columns, 1);
    for (int i = 0; i < b.rows; ++i) place_[rows[i]] = i;
    for (int c = 0; c < b.columns; ++c) {
      const int column = tree_.first[k] + c;
      for (SparseMatrix::InnerIterator a(matrix_, tree_.permutation[column]); a; ++a)
        if (const int row = position_[a.row()]; row >= column) *b.at(place_[row], c) += a.value();
    }
  }

  /// Subtracts what the finished supernodes with rows among these columns contribute.
  void update(int k) {
    Block& target = blocks_[k];
    for (int d = updates_[k], following; d >= 0; d = following) {
      following = next_[d];
      const std::vector<int>& rows = tree_.rows[d];
      Block& b = blocks_[d];
      const int from = done_[d];
      int to = from;
      while (to < b.rows && rows[to] < tree_.first[k + 1]) ++to;
      const int wide = to - from, high = b.rows - from;
      // C = L2 J L1ᵀ with L1 the rows in these columns, L2 those and all below.
      product_.resize(std::size_t(high) * wide);
      const double* right = b.at(from, 0);
      int right_rows = b.rows;
      if (b.mixed) {
        signed_.resize(std::size_t(wide) * b.columns);
        for (int c = 0; c < b.columns; ++c)
          for (int i = 0; i < wide; ++i)
            signed_[i + std::size_t(c) * wide] = b.sign[c] * *b.at(from + i, c);
        right = signed_.data();
        right_rows = wide;
      }
      dgemm_("N", "T", &high, &wide, &b.columns, &kOne, b.at(from, 0), &b.rows, right, &right_rows,
             &kZero, product_.data(), &high);
      for (int c = 0; c < wide; ++c) {
        double* column = target.at(0, rows[from + c] - tree_.first[k]);
        const double* source = product_.data() + std::ptrdiff_t(c) * high;
        for (int i = c; i < high; ++i) column[place_[rows[from + i]]] -= source[i];
      }
      done_[d] = to;
      queue(d);
    }
  }

  /// Hands a finished supernode to the owner of its next rows, or frees it.
  void queue(int d) {
    if (done_[d] == blocks_[d].rows) {
      blocks_[d].values = {};
      return;
    }
    const int owner = tree_.owner[tree_.rows[d][done_[d]]];
    next_[d] = updates_[owner];
    updates_[owner] = d;
  }

  /// Factors the diagonal block and the rows below; false when a pivot all but vanished.
  bool factor(Block& b) {
    int info = 0;
    saved_.resize(std::size_t(b.columns) * b.columns);
    for (int c = 0; c < b.columns; ++c)
      std::copy_n(b.at(0, c), b.columns, saved_.begin() + std::ptrdiff_t(c) * b.columns);
    dpotrf_("L", &b.columns, b.values.data(), &b.rows, &info);
    const int below = b.rows - b.columns;
    if (info == 0) {
      if (below > 0)
        dtrsm_("R", "L", "T", "N", &below, &b.columns, &kOne, b.values.data(), &b.rows,
               b.at(b.columns, 0), &b.rows);
      return true;
    }
    for (int c = 0; c < b.columns; ++c)
      std::copy_n(saved_.begin() + std::ptrdiff_t(c) * b.columns, b.columns, b.at(0, c));
    return factor_signed(b);
  }

  bool factor_signed(Block& b) {
    b.mixed = true;
    for (int first = 0; first < b.columns; first += kPanel) {
      const int width = std::min(kPanel, b.columns - first), end = first + width;
      if (!factor_panel(b, first, width)) return false;
      // Trailing columns: A -= L J Lᵀ.
      const int rest = b.columns - end, high = b.rows - end;
      if (rest == 0) break;
      signed_.resize(std::size_t(rest) * width);
      for (int c = 0; c < width; ++c)
        for (int i = 0; i < rest; ++i)
          signed_[i + std::size_t(c) * rest] = b.sign[first + c] * *b.at(end + i, first + c);
      dgemm_("N", "T", &high, &rest, &width, &kMinusOne, b.at(end, first), &b.rows, signed_.data(),
             &rest, &kOne, b.at(end, end), &b.rows);
    }
    return true;
  }

  /// Columns first .. first + width over all rows below, one by one.
  bool factor_panel(Block& b, int first, int width) {
    using Column = Eigen::Map<VecX>;
    for (int c = first; c < first + width; ++c) {
      const double pivot = *b.at(c, c);
      const double start = std::abs(saved_[c + std::ptrdiff_t(c) * b.columns]);
      if (!(std::abs(pivot) > kSmallPivot * start)) return false;
      b.sign[c] = pivot > 0.0 ? 1 : -1;
      const int high = b.rows - c;
      Column column(b.at(c, c), high);
      column *= b.sign[c] / std::sqrt(std::abs(pivot));
      for (int other = c + 1; other < first + width; ++other)
        Column(b.at(other, other), b.rows - other) -=
            b.sign[c] * *b.at(other, c) * Column(b.at(other, c), b.rows - other);
    }
    return true;
  }

  const SparseMatrix& matrix_;
  Supernodes tree_;
  std::vector<int> position_;  // dof -> position
  std::vector<int> place_;     // permuted index -> row of the current supernode
  std::vector<Block> blocks_;
  std::vector<int> done_;            // rows of a block that were used so far
  std::vector<int> updates_, next_;  // linked lists: blocks whose next rows a supernode owns
  std::vector<double> product_, signed_, saved_;
};

}  // namespace

int count_eigenvalues_below(const SparseMatrix& stiffness, const SparseMatrix& mass, double mu,
                            const std::vector<int>& ordering) {
  // Another shift near by when a pivot vanishes; 1e-7 is a tenth of the narrowest gap that is
  // tested.
  for (const double nudge : {0.0, 1e-7, -1e-7, 3e-8}) {
    const SparseMatrix matrix = shifted(stiffness, mass, -mu * (1.0 + nudge));
    const int negative = SignedCholesky(matrix, ordering).count_negative();
    if (negative >= 0) return negative;
  }
  throw NumericsError(
      fmt::format("Sturm check: no stable factorisation at the shift {:f} 1/s^2", mu));
}

}  // namespace archetide
