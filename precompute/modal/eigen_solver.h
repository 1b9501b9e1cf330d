#pragma once

#include <string>
#include <vector>

#include "precompute/modal/elasticity.h"
#include "precompute/modal/shifted_cholesky.h"

namespace archetide {

struct EigenOptions {
  int count = 0;             // eigenpairs wanted, >= 1; 2 count + 1 <= 3n - d
  double sigma = 0.0;        // shift, 1/s^2, negative: K - sigma M is SPD
  double tolerance = 1e-10;  // ARPACK's relative accuracy of 1 / (lambda - sigma)
  int max_restarts = 300;
};

struct EigenResult {
  VecX values;   // count, ascending, 1/s^2
  MatX vectors;  // 3n x count, M-orthonormal
  int operator_calls = 0;
};

/// The lowest eigenpairs of K phi = lambda M phi that are M-orthogonal to `deflated` (3n x d,
/// M-orthonormal eigenvectors known beforehand; d may be 0). ARPACK shift-invert [LSY98]; `factor`
/// is that of K - sigma M, `mass` is scalar n x n. Not reentrant (ARPACK keeps static state).
/// Throws NumericsError.
EigenResult lowest_eigenpairs(ShiftedCholesky& factor, const SparseMatrix& mass,
                              const MatX& deflated, const EigenOptions& options);

/// Number of eigenvalues of (K, M) below mu: negative pivots of K - mu M = L D L^T (Sylvester).
int count_eigenvalues_below(const SparseMatrix& stiffness, const SparseMatrix& mass, double mu,
                            const std::vector<int>& ordering);

struct BlasInfo {
  std::string name;
  bool slow = false;  // the reference BLAS: 4 to 10 times slower
};

/// The BLAS in use; limits it to one thread (two lose at this size).
BlasInfo prepare_blas();

}  // namespace archetide
