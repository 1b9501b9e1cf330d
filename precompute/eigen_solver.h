#pragma once

#include <string>

#include "common/profile.h"
#include "precompute/elasticity.h"

namespace archetide {

struct EigenOptions {
  int count = 0;             // eigenpairs wanted, >= 1
  double sigma = 0.0;        // shift, 1/s^2, negative: K - sigma M is SPD
  double tolerance = 1e-10;  // ARPACK's relative accuracy of eigenvalues
  int max_restarts = 300;
};

struct EigenResult {
  VecX values;   // count, ascending, 1/s^2
  MatX vectors;  // 3n x count, M-orthonormal
  int operator_calls = 0;
};

/// The lowest eigenpairs of K phi = lambda M phi that are M-orthogonal to `deflated` (3n x d,
/// M-orthonormal eigenvectors known beforehand). ARPACK shift-invert on a supernodal Cholesky
/// factor. `mass` is scalar n x n. Phases factor and iterate go to `profile`. Throws NumericsError.
EigenResult lowest_eigenpairs(const SparseMatrix& stiffness, const SparseMatrix& mass,
                              const MatX& deflated, const EigenOptions& options, Profile& profile);

/// Number of eigenvalues of (K, M) below mu: negative pivots of K - mu M = L D L^T (Sylvester).
int count_eigenvalues_below(const SparseMatrix& stiffness, const SparseMatrix& mass, double mu);

/// Name of the BLAS in use; slow when it is the reference one.
std::string blas_name(bool& slow);

}  // namespace archetide
