#pragma once

#include <memory>

#include "precompute/ordering.h"

namespace archetide {

/// Supernodal Cholesky factor of an SPD matrix.
class ShiftedCholesky {
 public:
  /// Throws NumericsError when the matrix is not positive definite, MachineError without memory.
  ShiftedCholesky(const SparseMatrix& matrix, const std::vector<int>& ordering);
  ~ShiftedCholesky();

  int size() const;
  /// A^-1 b, size() x any. Four columns cost little more than one: both read the factor once.
  MatX solve(const MatX& b);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
