// Counts eigenvalues by a multifrontal L D L^T that keeps no factor. CHOLMOD gives the supernodes;
// each front is eliminated by Cholesky where it is positive definite (almost everywhere below the
// lowest modes) and by Bunch-Kaufman pivoting inside the supernode elsewhere. Fill and operations
// are those of the Cholesky factor.

#include "precompute/eigen_solver.h"

#include <algorithm>

#include "precompute/cholmod_view.h"
#include "precompute/ordering.h"

extern "C" {
void dpotrf_(const char* uplo, const int* n, double* a, const int* lda, int* info);
void dsytrf_(const char* uplo, const int* n, double* a, const int* lda, int* pivots, double* work,
             const int* lwork, int* info);
void dsytrs_(const char* uplo, const int* n, const int* nrhs, const double* a, const int* lda,
             const int* pivots, double* b, const int* ldb, int* info);
void dtrsm_(const char* side, const char* uplo, const char* trans, const char* diag, const int* m,
            const int* n, const double* alpha, const double* a, const int* lda, double* b,
            const int* ldb);
void dsyrk_(const char* uplo, const char* trans, const int* n, const int* k, const double* alpha,
            const double* a, const int* lda, const double* beta, double* c, const int* ldc);
}

namespace archetide {
namespace {

const double kOne = 1.0, kMinusOne = -1.0;

/// A dense symmetric front, lower triangle in column major order: `columns` of `rows` are
/// eliminated here.
struct Front {
  int rows, columns;
  double* a;  // rows x rows
};

/// Negative eigenvalues of D as left by dsytrf; a 2 x 2 pivot always has one of each sign.
int negative_pivots(const Front& f, const std::vector<int>& pivots) {
  int negative = 0;
  for (int k = 0; k < f.columns; ++k) {
    const bool pair = pivots[k] < 0;
    negative += pair || f.a[k + std::ptrdiff_t(k) * f.rows] < 0.0;
    k += pair;
  }
  return negative;
}

/// Eliminates an indefinite front and returns its negative pivots. `diagonal`: the pivot block,
/// saved.
int eliminate_indefinite(Front f) {
  const int below = f.rows - f.columns, lwork = 64 * f.columns;
  std::vector<int> pivots(f.columns);
  std::vector<double> work(lwork);
  int info = 0;
  dsytrf_("L", &f.columns, f.a, &f.rows, pivots.data(), work.data(), &lwork, &info);
  if (info > 0) throw NumericsError("the inertia shift hits an eigenvalue exactly");
  using Block = Eigen::Map<MatX, 0, Eigen::OuterStride<>>;
  const Block lower(f.a + f.columns, below, f.columns, Eigen::OuterStride<>(f.rows));
  Block update(f.a + f.columns + std::ptrdiff_t(f.columns) * f.rows, below, below,
               Eigen::OuterStride<>(f.rows));
  MatX solved = lower.transpose();  // A11^-1 A21ᵀ
  if (below > 0)
    dsytrs_("L", &f.columns, &below, f.a, &f.rows, pivots.data(), solved.data(), &f.columns, &info);
  update.triangularView<Eigen::Lower>() -= lower * solved;
  return negative_pivots(f, pivots);
}

/// Schur complement of the front's columns into its trailing block; returns the negative pivots.
int eliminate(Front f, std::vector<double>& saved) {
  const int below = f.rows - f.columns;
  saved.resize(std::size_t(f.columns) * f.columns);
  for (int c = 0; c < f.columns; ++c)
    std::copy_n(f.a + std::ptrdiff_t(c) * f.rows, f.columns,
                saved.begin() + std::ptrdiff_t(c) * f.columns);
  int info = 0;
  dpotrf_("L", &f.columns, f.a, &f.rows, &info);
  if (info > 0) {
    for (int c = 0; c < f.columns; ++c)
      std::copy_n(saved.begin() + std::ptrdiff_t(c) * f.columns, f.columns,
                  f.a + std::ptrdiff_t(c) * f.rows);
    return eliminate_indefinite(f);
  }
  if (below > 0) {
    double* lower = f.a + f.columns;
    dtrsm_("R", "L", "T", "N", &below, &f.columns, &kOne, f.a, &f.rows, lower, &f.rows);
    dsyrk_("L", "N", &below, &f.columns, &kMinusOne, lower, &f.rows, &kOne,
           lower + std::ptrdiff_t(f.columns) * f.rows, &f.rows);
  }
  return 0;
}

/// Supernodes in postorder: rows[k] are the permuted indices of front k, its own columns first.
struct Supernodes {
  std::vector<int> permutation;  // position -> dof
  std::vector<int> first;        // first column of each supernode
  std::vector<std::vector<int>> rows;
  std::vector<int> parent;  // -1 at a root
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
  std::vector<int> owner(L->n);
  for (int k = 0; k < count; ++k) {
    std::fill(owner.begin() + super[k], owner.begin() + super[k + 1], k);
    result.rows.emplace_back(s + pi[k], s + pi[k + 1]);
  }
  for (int k = 0; k < count; ++k) {
    const int columns = super[k + 1] - super[k];
    const auto& rows = result.rows[k];
    result.parent.push_back(columns < int(rows.size()) ? owner[rows[columns]] : -1);
  }
  cholmod_free_factor(&L, &cholmod.common);
  return result;
}

/// Adds a child's trailing block, whose rows are `child`, into the front; `place` maps index ->
/// front row.
void extend_add(const std::vector<int>& child, int child_columns, const double* block,
                const std::vector<int>& place, Front f) {
  const int below = int(child.size()) - child_columns;
  std::vector<int> at(below);
  for (int i = 0; i < below; ++i) at[i] = place[child[child_columns + i]];
  for (int c = 0; c < below; ++c) {
    double* target = f.a + std::ptrdiff_t(at[c]) * f.rows;
    const double* source = block + std::ptrdiff_t(c) * below;
    for (int i = c; i < below; ++i) target[at[i]] += source[i];
  }
}

/// Adds the matrix entries of the supernode's columns into its front.
void assemble_entries(const SparseMatrix& matrix, const Supernodes& tree,
                      const std::vector<int>& position, int k, const std::vector<int>& place,
                      Front f) {
  for (int c = 0; c < f.columns; ++c) {
    const int column = tree.first[k] + c;
    for (SparseMatrix::InnerIterator a(matrix, tree.permutation[column]); a; ++a)
      if (const int row = position[a.row()]; row >= column)
        f.a[place[row] + std::ptrdiff_t(c) * f.rows] += a.value();
  }
}

std::vector<double> trailing_block(Front f) {
  const int below = f.rows - f.columns;
  std::vector<double> block(std::size_t(below) * below);
  for (int c = 0; c < below; ++c)
    std::copy_n(f.a + f.columns + c + std::ptrdiff_t(f.columns + c) * f.rows, below - c,
                block.begin() + std::ptrdiff_t(c) * below + c);
  return block;
}

}  // namespace

int count_eigenvalues_below(const SparseMatrix& stiffness, const SparseMatrix& mass, double mu,
                            const std::vector<int>& ordering) {
  const SparseMatrix matrix = shifted(stiffness, mass, -mu);
  const Supernodes tree = supernodes(matrix, ordering);
  const int count = int(tree.rows.size()), n = int(matrix.rows());
  std::vector<int> position(n), place(n);
  for (int i = 0; i < n; ++i) position[tree.permutation[i]] = i;
  std::vector<std::vector<int>> children(count);
  std::vector<std::vector<double>> blocks(count);  // trailing blocks that wait for their parent
  std::vector<double> buffer, saved;
  int negative = 0;
  for (int k = 0; k < count; ++k) {
    const int rows = int(tree.rows[k].size());
    buffer.assign(std::size_t(rows) * rows, 0.0);
    const Front front{rows, tree.first[k + 1] - tree.first[k], buffer.data()};
    for (int i = 0; i < rows; ++i) place[tree.rows[k][i]] = i;
    assemble_entries(matrix, tree, position, k, place, front);
    for (int child : children[k]) {
      extend_add(tree.rows[child], tree.first[child + 1] - tree.first[child], blocks[child].data(),
                 place, front);
      blocks[child] = {};
    }
    negative += eliminate(front, saved);
    if (tree.parent[k] < 0) continue;
    blocks[k] = trailing_block(front);
    children[tree.parent[k]].push_back(k);
  }
  return negative;
}

}  // namespace archetide
