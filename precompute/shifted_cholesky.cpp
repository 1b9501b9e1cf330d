#include "precompute/shifted_cholesky.h"

#include <algorithm>

#include "common/check.h"
#include "precompute/cholmod_view.h"
#include "precompute/memory.h"

namespace archetide {
namespace {

/// Peak memory of the modes (the factor, the Krylov basis, the fronts of the Sturm count) over the
/// factor's. Measured on tori: 3.9 at 60k tets (factor 115 MB), 4.2 at 160k (434 MB).
constexpr double kPeakOverFactor = 4.5;

/// One row of four right-hand sides. A solve waits for the factor to come from memory: four columns
/// cost little more than one.
constexpr int kWidth = 4;
using Row = Eigen::Array<double, kWidth, 1>;
using Rows = std::vector<Row>;

/// A panel of the factor: `rows` x `columns`, column major, lower trapezoid.
struct Panel {
  int rows, columns;
  const double* values;
  const double* column(int c) const { return values + std::ptrdiff_t(c) * rows; }
};

/// G columns from c on: solves for their rows and takes them off the rows below.
template <int G>
void forward(const Panel& p, int c, Row* x) {
  const double* l[G];
  Row y[G];
  for (int k = 0; k < G; ++k) {
    l[k] = p.column(c + k);
    y[k] = x[c + k];
    for (int j = 0; j < k; ++j) y[k] -= l[j][c + k] * y[j];
    y[k] /= l[k][c + k];
    x[c + k] = y[k];
  }
  for (int i = c + G; i < p.rows; ++i) {
    Row sum = x[i];
    for (int k = 0; k < G; ++k) sum -= l[k][i] * y[k];
    x[i] = sum;
  }
}

/// What the rows from `from` on take off each of G columns. Named sums stay in registers.
template <int G>
void take_off_below(const double* const* l, int from, int rows, const Row* x, Row* y) {
  if constexpr (G == 4) {
    Row a = Row::Zero(), b = a, c = a, d = a;
    for (int i = from; i < rows; ++i) {
      const Row& below = x[i];  // a copy would be made in halves and stall
      a += l[0][i] * below;
      b += l[1][i] * below;
      c += l[2][i] * below;
      d += l[3][i] * below;
    }
    y[0] -= a, y[1] -= b, y[2] -= c, y[3] -= d;
  } else {
    Row a = Row::Zero();
    for (int i = from; i < rows; ++i) a += l[0][i] * x[i];
    y[0] -= a;
  }
}

/// The same with the transpose: takes the rows below off, then solves.
template <int G>
void backward(const Panel& p, int c, Row* x) {
  const double* l[G];
  Row y[G];
  for (int k = 0; k < G; ++k) l[k] = p.column(c + k), y[k] = x[c + k];
  take_off_below<G>(l, c + G, p.rows, x, y);
  for (int k = G - 1; k >= 0; --k) {
    for (int j = k + 1; j < G; ++j) y[k] -= l[k][c + j] * y[j];
    y[k] /= l[k][c + k];
    x[c + k] = y[k];
  }
}

constexpr int kGroup = 4;  // columns that share a pass over the rows below

}  // namespace

struct ShiftedCholesky::Impl {
  CholmodCommon cholmod;
  cholmod_factor* factor = nullptr;
  Rows x, panel_rows;  // n; rows of one panel

  ~Impl() { cholmod_free_factor(&factor, &cholmod.common); }

  const int* integers(const void* list) const { return static_cast<const int*>(list); }
  Panel panel(int s) const {
    const int *first = integers(factor->super), *start = integers(factor->pi),
              *at = integers(factor->px);
    return {start[s + 1] - start[s], first[s + 1] - first[s],
            static_cast<const double*>(factor->x) + at[s]};
  }
  const int* rows_of(int s) const { return integers(factor->s) + integers(factor->pi)[s]; }

  /// L x <- x
  void solve_lower() {
    for (int s = 0; s < int(factor->nsuper); ++s) {
      const Panel p = panel(s);
      const int* rows = rows_of(s);
      for (int i = 0; i < p.columns; ++i) panel_rows[i] = x[rows[i]];
      std::fill_n(panel_rows.begin() + p.columns, p.rows - p.columns, Row::Zero());
      int c = 0;
      for (; c + kGroup <= p.columns; c += kGroup) forward<kGroup>(p, c, panel_rows.data());
      for (; c < p.columns; ++c) forward<1>(p, c, panel_rows.data());
      for (int i = 0; i < p.columns; ++i) x[rows[i]] = panel_rows[i];
      for (int i = p.columns; i < p.rows; ++i) x[rows[i]] += panel_rows[i];
    }
  }
  /// L^T x <- x
  void solve_upper() {
    for (int s = int(factor->nsuper) - 1; s >= 0; --s) {
      const Panel p = panel(s);
      const int* rows = rows_of(s);
      for (int i = 0; i < p.rows; ++i) panel_rows[i] = x[rows[i]];
      int c = p.columns;
      for (; c % kGroup != 0; --c) backward<1>(p, c - 1, panel_rows.data());
      for (; c > 0; c -= kGroup) backward<kGroup>(p, c - kGroup, panel_rows.data());
      for (int i = 0; i < p.columns; ++i) x[rows[i]] = panel_rows[i];
    }
  }
};

ShiftedCholesky::ShiftedCholesky(const SparseMatrix& matrix, const std::vector<int>& ordering)
    : impl_(std::make_unique<Impl>()) {
  cholmod_common* common = &impl_->cholmod.common;
  cholmod_sparse view = cholmod_view(matrix);
  impl_->factor = cholmod_analyze_p(&view, const_cast<int*>(ordering.data()), nullptr, 0, common);
  impl_->cholmod.require(impl_->factor, "analysing the stiffness");
  // The size of the factor is known now: better no answer than the machine's out-of-memory killer.
  demand_memory(kPeakOverFactor * 8.0 * static_cast<double>(impl_->factor->xsize),
                "computing modes with " + std::to_string(impl_->factor->n) + " unknowns",
                "lower tet.target");
  common->quick_return_if_not_posdef = 1;
  cholmod_factorize(&view, impl_->factor, common);
  if (common->status == CHOLMOD_NOT_POSDEF || impl_->factor->minor < impl_->factor->n)
    throw NumericsError(
        "the shifted stiffness is not positive definite: inverted tets, or a Poisson ratio too "
        "close to 0.5");
  impl_->cholmod.require(true, "factoring the stiffness");
  ARCHETIDE_CHECK(impl_->factor->is_super && impl_->factor->is_ll);
  impl_->x.resize(impl_->factor->n);
  impl_->panel_rows.resize(impl_->factor->n);
}

ShiftedCholesky::~ShiftedCholesky() = default;

int ShiftedCholesky::size() const { return int(impl_->factor->n); }

MatX ShiftedCholesky::solve(const MatX& b) {
  ARCHETIDE_CHECK_OP(b.rows(), ==, size());
  const int* permutation = impl_->integers(impl_->factor->Perm);
  MatX solution(b.rows(), b.cols());
  for (Eigen::Index first = 0; first < b.cols(); first += kWidth) {
    const int width = int(std::min<Eigen::Index>(kWidth, b.cols() - first));
    for (int i = 0; i < size(); ++i) {
      impl_->x[i].setZero();
      for (int k = 0; k < width; ++k) impl_->x[i][k] = b(permutation[i], first + k);
    }
    impl_->solve_lower();
    impl_->solve_upper();
    for (int i = 0; i < size(); ++i)
      for (int k = 0; k < width; ++k) solution(permutation[i], first + k) = impl_->x[i][k];
  }
  return solution;
}

}  // namespace archetide
