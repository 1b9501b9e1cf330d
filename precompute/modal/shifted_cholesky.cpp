#include "precompute/modal/shifted_cholesky.h"

#include <fmt/core.h>

#include <algorithm>

#include "precompute/modal/cholmod_view.h"
#include "precompute/modal/memory.h"

namespace archetide {
namespace {

/// Peak memory of the modes (the factor, ARPACK's vectors, the fronts of the Sturm count) over the
/// factor's. Measured on tori: 3.9 at 60k tets (factor 115 MB), 4.2 at 160k (434 MB).
constexpr double kPeakOverFactor = 4.5;

}  // namespace

struct ShiftedCholesky::Impl {
  CholmodCommon cholmod;
  cholmod_factor* factor = nullptr;
  // Reused by every solve.
  cholmod_dense *right = nullptr, *solution = nullptr, *work = nullptr, *work2 = nullptr;

  ~Impl() {
    for (cholmod_dense** dense : {&right, &solution, &work, &work2})
      cholmod_free_dense(dense, &cholmod.common);
    cholmod_free_factor(&factor, &cholmod.common);
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
                fmt::format("computing modes with {} unknowns", impl_->factor->n),
                "lower tet.target");
  common->quick_return_if_not_posdef = 1;
  cholmod_factorize(&view, impl_->factor, common);
  if (common->status == CHOLMOD_NOT_POSDEF || impl_->factor->minor < impl_->factor->n)
    throw NumericsError(
        "the shifted stiffness is not positive definite: inverted tets, or a Poisson ratio too "
        "close to 0.5");
  impl_->cholmod.require(true, "factoring the stiffness");
  impl_->right = cholmod_zeros(view.nrow, 1, CHOLMOD_REAL, common);
  impl_->cholmod.require(impl_->right, "factoring the stiffness");
}

ShiftedCholesky::~ShiftedCholesky() = default;

int ShiftedCholesky::size() const { return int(impl_->factor->n); }

void ShiftedCholesky::solve(const double* b, double* x) {
  std::copy_n(b, size(), static_cast<double*>(impl_->right->x));
  const bool good =
      cholmod_solve2(CHOLMOD_A, impl_->factor, impl_->right, nullptr, &impl_->solution, nullptr,
                     &impl_->work, &impl_->work2, &impl_->cholmod.common);
  impl_->cholmod.require(good, "solving with the stiffness factor");
  std::copy_n(static_cast<const double*>(impl_->solution->x), size(), x);
}

}  // namespace archetide
