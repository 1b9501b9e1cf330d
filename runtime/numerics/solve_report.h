#pragma once

namespace archetide {

/// What an iterative solve did. Not converging is a result, not an exception: the caller decides.
struct SolveReport {
  int iterations = 0;
  double residual = 0.0;  // true |b - A x|_2 / |b|_2 at the end (recomputed, not the recursion's)
  bool converged = false;
  double setup_seconds = 0.0, solve_seconds = 0.0;
};

}  // namespace archetide
