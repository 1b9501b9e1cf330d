#pragma once

#include <cstddef>
#include <vector>

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

  /// y = A x on one segment of plane k.
  void apply_segment(const Segment& s, int k, const double* x, double* y) const;

  /// Coefficients of segment number s of plane k, which is not uniform, n cells long: the diagonal
  /// and the faces to unknowns (else 0) at -x, +x, -y, +y, -z, +z, n entries each.
  const double* coefficients(int k, std::size_t s) const {
    return planes_[k].coefficient.data() + planes_[k].first[s];
  }

  const Blocks& blocks() const { return blocks_; }
  const RowSegments& rows() const { return rows_; }
  const PoissonMatrix& matrix() const { return *matrix_; }
  std::size_t unknowns() const { return unknowns_; }

 private:
  const PoissonMatrix* matrix_ = nullptr;
  // The coefficients of a plane's segments in a row; `first` has an entry per segment.
  struct PlaneCoefficients {
    std::vector<double> coefficient;
    std::vector<std::size_t> first;
  };
  void pack_coefficients(int k);

  RowSegments rows_;
  std::vector<PlaneCoefficients> planes_;
  Blocks blocks_;
  std::size_t unknowns_ = 0;
};

}  // namespace archetide
