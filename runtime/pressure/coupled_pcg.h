#pragma once

#include <vector>

#include "runtime/numerics/fused_steps.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/solve_report.h"
#include "runtime/pressure/coupled_operator.h"
#include "runtime/pressure/deflation.h"

namespace archetide {

struct CoupledPcgOptions {
  double tolerance = 1e-8;  // of |b - A x|_2 / |b|_2, and of the error of the bodies' velocities
  std::vector<VecX> y;      // the bodies' velocities before the solve, 6 + r each
  double absolute = 0.0;    // |b - A x|_2 below which the solve ends whatever |b| is
  int max_iterations = 200;
};

/// Conjugate gradients for the coupled operator, preconditioned by one multigrid cycle of the water
/// and, where bodies are light, deflation. The same method as pcg.h in fewer passes over memory: x,
/// r and q = A p in fp64, directions and cycle in fp32 (the rounded direction is the direction: x
/// and r keep agreeing in fp64).
///
/// Why two tests: with Z = A_w^-1 F and the added mass M = F^T Z, a residual r leaves the bodies
/// with an error of velocity e = (H + M)^-1 Z^T r, and Z^T r is about F^T V r for the cycle V.
/// (What the cycle does not see of it is at most a share of |r| in A_w^-1, about sqrt(r . V r).) A
/// very light body's |b|_2 tells nothing: it holds F y*, and y* is up to 1 / (density ratio) times
/// the velocity v that is left of it. So e . M e, with a rough M, is compared with v . M v; but
/// where bodies hardly move in water that moves much, with a thousandth of the energy of the water.
///
/// Parts of the water, apart from the others, that nothing moves keep the constant that solves them
/// (C18a): else the cycle, whose coarse cells lie on both sides of a wall, would stir them within the
/// tolerance.
class CoupledPcg {
 public:
  /// All of them must stay as they are until the solve is over; `cycle` is set up for op.water().
  void setup(const CoupledOperator& op, Multigrid& cycle, Deflation& deflation);
  /// Solves A x = b from the x given; x and b have an entry per cell of the grid. A tolerance that
  /// rounding does not let it reach (below some 1e-10 on large grids) is met as well as it can be.
  SolveReport solve(const double* b, double* x, const CoupledPcgOptions& options);

  std::size_t bytes() const;

 private:
  void find_still_parts(const double* b, double* x);
  void hold_still(double* r) const;
  void hold_still(float* z) const;
  double norm_in_range(const double* b);
  double round_off(const double* x);
  double true_residual(const double* b, double* x);
  double first_residual(const double* b, double* x, double norm_b);
  double iterate(const double* b, double* x, double residual);
  double precondition(double scale);
  bool close_enough(const double* b, double* x);
  double body_error(double scale) const;
  double apply_bodies(const float* p, double* q);
  void start_deflated(double residual, double* x);
  void gather(const float* z);
  void respond();
  double cycle_with_closed(double scale);

  const CoupledOperator* op_ = nullptr;
  Multigrid* cycle_ = nullptr;
  Deflation* deflation_ = nullptr;
  FusedSteps steps_;
  std::vector<std::vector<std::size_t>> place_;  // of each body's cells in the padded layout
  std::vector<double> r_, q_;                    // per cell of the grid
  std::vector<float> p_;                         // padded
  std::vector<VecX> momentum_, response_;        // Fhat^T z of each body, and H^-1 of it
  std::vector<MatX> error_;                      // (H + M)^-1 M (H + M)^-1 of each body

  std::vector<const Blocks*> still_;  // parts of the water that are left as they are

  CoupledPcgOptions options_;
  SolveReport report_;
  double target_ = 0.0;         // of |r|_2
  double energy_target_ = 0.0;  // of the square of the bodies' error; 0 as long as not known
  double energy_ = 0.0;         // that square for the r that was preconditioned last
  double pending_ = 0.0;        // part of p_ that x has not yet received
};

}  // namespace archetide
