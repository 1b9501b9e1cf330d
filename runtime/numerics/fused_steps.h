#pragma once

#include <vector>

#include "runtime/numerics/padded_layout.h"
#include "runtime/numerics/poisson_operator.h"

namespace archetide {

/// The passes of conjugate gradients over memory, each as few as can be. fp64 vectors (x, r, q, b)
/// have an entry per cell of the grid and are touched on unknowns only; fp32 ones (direction p,
/// preconditioned residual z, right-hand side of the cycle) live in a padded layout, 0 off the
/// unknowns. Sums are added plane by plane: results do not depend on the number of threads.
class FusedSteps {
 public:
  void setup(const PoissonOperator& op, const PaddedLayout& layout) { op_ = &op, layout_ = layout; }

  /// x += step p;  p = zs z + beta p;  q = A p; returns p . q
  /// (reads z, p, x; writes p, x, q: 36 bytes an unknown)
  double direction(double step, float zs, const float* z, float beta, float* p, double* x,
                   double* q);
  /// r -= step q;  b = scale r; returns r . r   (28 bytes)
  double residual_step(double step, const double* q, double* r, double scale, float* b);
  /// r = b - A x; returns r . r   (24 bytes)
  double residual(const double* b, const double* x, double* r);
  /// x += step p
  void advance(double step, const float* p, double* x);
  /// b = scale r
  void load(const double* r, double scale, float* b);
  /// r . r
  double square(const double* r);
  /// r . z
  double work(const double* r, const float* z);

 private:
  template <class F>
  void for_planes(F&& f);
  double total() const;
  bool parallel() const;

  const PoissonOperator* op_ = nullptr;
  PaddedLayout layout_;
  std::vector<double> sum_;  // of each plane
};

/// out = (A p) on the cells [begin, end) of a segment of plane k, with p in a padded layout;
/// returns p . out.
double product_row(const PoissonOperator& op, const PaddedLayout& layout, int k,
                   std::size_t segment, int begin, int end, const float* p, double* out);

}  // namespace archetide
