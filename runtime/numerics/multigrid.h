#pragma once

#include <cstddef>
#include <memory>

#include "runtime/numerics/components.h"
#include "runtime/numerics/padded_layout.h"
#include "runtime/numerics/poisson_operator.h"

namespace archetide {

struct MultigridLevel;

/// One symmetric fp32 V(2,2) cycle for a PoissonMatrix: red-black Gauss-Seidel (red, black before;
/// black, red after the coarse correction), 2x2x2 piecewise-constant aggregation with face
/// coefficients rescaled by 1/2. Symmetric positive definite on the unknowns for every admissible
/// matrix; bit-identical for any thread count.
/// Multigrid as the preconditioner of conjugate gradients: [MST10], [D39].
class Multigrid {
 public:
  Multigrid();
  ~Multigrid();
  Multigrid(Multigrid&&) noexcept;
  Multigrid& operator=(Multigrid&&) noexcept;

  /// Builds the levels; storage is reused from one setup to the next. With `closed`, the cycle is
  /// projected on both sides: it acts as zero on the indicator of every closed component, and its
  /// result has zero mean there (`closed` must outlive the next apply). Without, it treats
  /// constants like any other vector.
  void setup(const PoissonOperator& op, const ClosedComponents* closed = nullptr);

  /// z = V r, written on op.blocks(), 0 there in cells without an unknown.
  void apply(const double* r, double* z);

  /// The same cycle in place, for solvers that keep their vectors in the layout of the finest
  /// level: iterate() = V rhs(), without projection. rhs() is read on unknowns; iterate() is 0
  /// elsewhere. Returns the sum of rhs x iterate.
  double cycle();
  const PaddedLayout& layout() const;
  float* rhs();
  float* iterate();

  int levels() const;
  /// Finest first; as of the last setup.
  const MultigridLevel& level(int l) const;
  /// Memory held, bytes.
  std::size_t bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
