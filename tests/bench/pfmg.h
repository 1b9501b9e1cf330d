#pragma once

#include <memory>

#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// One V(1,1) cycle of hypre's PFMG for a PoissonMatrix, to compare with. fp64, one thread
/// (Debian's hypre is built without OpenMP). Rows of cells without an unknown are identities.
class Pfmg {
 public:
  explicit Pfmg(const PoissonMatrix& matrix);
  ~Pfmg();
  Pfmg(const Pfmg&) = delete;
  Pfmg& operator=(const Pfmg&) = delete;

  /// z = V r; the copies to and from hypre's vectors are part of the time.
  void apply(const double* r, double* z);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
