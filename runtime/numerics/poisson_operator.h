#pragma once

#include <cstddef>

#include "runtime/numerics/poisson_matrix.h"
#include "runtime/numerics/row_segments.h"
#include "runtime/numerics/vector_ops.h"

namespace archetide {

/// A PoissonMatrix prepared for many products: the same A, visited by row segments only. Vectors
/// are only touched inside blocks() (per plane: first to last unknown); y is set to 0 on blocks'
/// cells without an unknown, and x is not read there.
class PoissonOperator {
 public:
  /// Keeps a pointer to `matrix`: it must outlive the operator and not change before the next
  /// setup.
  void setup(const PoissonMatrix& matrix);

  std::size_t size() const { return matrix_ ? matrix_->size() : 0; }
  /// y = A x   (interior: n reads, n writes; elsewhere 5n reads)
  void apply(const double* x, double* y) const;

  const Blocks& blocks() const { return blocks_; }
  const RowSegments& rows() const { return rows_; }
  const PoissonMatrix& matrix() const { return *matrix_; }
  std::size_t unknowns() const { return unknowns_; }

 private:
  const PoissonMatrix* matrix_ = nullptr;
  RowSegments rows_;
  Blocks blocks_;
  std::size_t unknowns_ = 0;
};

}  // namespace archetide
