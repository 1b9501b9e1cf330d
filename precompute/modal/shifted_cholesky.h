#pragma once

#include <memory>

#include "precompute/modal/ordering.h"

namespace archetide {

/// Supernodal Cholesky factor [CDHR08] of an SPD matrix; solves with one right-hand side at a time.
class ShiftedCholesky {
 public:
  /// Throws NumericsError when the matrix is not positive definite, MachineError without memory.
  ShiftedCholesky(const SparseMatrix& matrix, const std::vector<int>& ordering);
  ~ShiftedCholesky();

  int size() const;
  /// x = A^-1 b, both of size(); may be the same.
  void solve(const double* b, double* x);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
