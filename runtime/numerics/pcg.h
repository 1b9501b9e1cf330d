#pragma once

#include <cmath>
#include <vector>

#include "runtime/numerics/linear_operator.h"
#include "runtime/numerics/solve_report.h"
#include "runtime/numerics/vector_ops.h"

namespace archetide {

struct PcgOptions {
  double tolerance = 1e-8;  // of |b - A x|_2 / |b|_2, 1e-14 .. 1e-2
  double absolute = 0.0;  // |b - A x|_2 below which the solve ends whatever |b| is (round-off of b)
  int max_iterations = 200;  // products with A, not counting those that check the residual
  bool check_true_residual =
      true;  // recompute b - A x where the recursion says it is small, go on if it is not
};

/// The vectors of a solve, kept between solves.
struct PcgWorkspace {
  std::vector<double> r, z, p, q;  // residual, preconditioned residual, direction, A p
  Blocks blocks;                   // used when the operator names none

  void reserve(std::size_t n) {
    if (r.size() != n) {
      for (auto* v : {&r, &z, &p, &q}) v->assign(n, 0.0);
      blocks = all_blocks(n);
    }
  }
};

namespace detail {

// A solve in progress: the state of one call of pcg.
template <class Op, class M>
class PcgRun {
 public:
  PcgRun(const Op& a, M& m, const double* b, double* x, const PcgOptions& options, PcgWorkspace& w)
      : a_(a), m_(m), b_(b), x_(x), options_(options), w_(w), blocks_(pieces()) {}

  SolveReport solve() {
    // |b| in the range of A sets the target.
    copy(blocks_, b_, w_.r.data());
    project(w_.r.data());
    norm_b_ = norm(blocks_, w_.r.data());
    if (norm_b_ == 0.0) fill(blocks_, 0.0, x_);
    target_ = std::fmax(options_.tolerance * norm_b_, options_.absolute);

    // Each round starts from the true residual; a round that ends early was the recursion's error.
    double residual = true_residual();
    while (residual > target_ && report_.iterations < options_.max_iterations) {
      const double before = residual;
      const double claimed = iterate(residual);
      residual = options_.check_true_residual || claimed > target_ ? true_residual() : claimed;
      if (!(residual < kStagnation * before)) break;
    }
    project(x_);
    report_.residual = norm_b_ > 0.0 ? residual / norm_b_ : residual;
    report_.converged = residual <= target_;
    return report_;
  }

 private:
  // A round that does not reduce the true residual by at least this factor has met the limit of
  // round-off.
  static constexpr double kStagnation = 0.9;

  const Blocks& pieces() const {
    if constexpr (requires { a_.blocks(); })
      return a_.blocks();
    else
      return w_.blocks;
  }
  void project(double* v) const {
    if constexpr (requires { a_.project(v); }) a_.project(v);
  }

  // r = b - A x, returns |r|
  double true_residual() {
    double* r = w_.r.data();
    a_.apply(x_, r);
    subtract_from(blocks_, b_, r);
    project(r);
    return norm(blocks_, r);
  }

  // Conjugate gradients until the recursion's |r| meets the target; returns that |r|. Flexible
  // (Polak-Ribiere) beta: the fp32 cycle is symmetric only to its rounding.
  double iterate(double residual) {
    double *r = w_.r.data(), *z = w_.z.data(), *p = w_.p.data(), *q = w_.q.data();
    m_.apply(r, z);
    double rho = dot(blocks_, r, z);
    copy(blocks_, z, p);
    while (report_.iterations < options_.max_iterations) {
      a_.apply(p, q);
      ++report_.iterations;
      const double curvature = dot(blocks_, p, q);
      if (!(rho > 0.0) || !(curvature > 0.0))
        break;  // lost to rounding (or not definite): start anew
      const double alpha = rho / curvature;
      residual = std::sqrt(step_and_dot(blocks_, alpha, p, q, x_, r));
      if (residual <= target_) break;
      m_.apply(r, z);
      const auto [zr, zq] = dot_two(blocks_, z, r, q);
      xpay(blocks_, z, -alpha * zq / rho, p);  // r_new - r_old = -alpha q
      rho = zr;
    }
    return residual;
  }

  const Op& a_;
  M& m_;
  const double* b_;
  double* x_;
  const PcgOptions& options_;
  PcgWorkspace& w_;
  const Blocks& blocks_;
  double norm_b_ = 0.0, target_ = 0.0;
  SolveReport report_;
};

}  // namespace detail

/// Solves A x = b by preconditioned conjugate gradients [HS52] in fp64, from the x given. When `a`
/// has project(), b is taken by its part in the range of A, and x comes back without null-space
/// part. The residual reported is recomputed at the end. Allocates only when the size changes.
template <LinearOperator Op, Preconditioner M>
SolveReport pcg(const Op& a, M& m, const double* b, double* x, const PcgOptions& options,
                PcgWorkspace& workspace) {
  const Stopwatch watch;
  workspace.reserve(a.size());
  SolveReport report = detail::PcgRun<Op, M>(a, m, b, x, options, workspace).solve();
  report.solve_seconds = watch.wall();
  report.solve_cpu_seconds = watch.cpu();
  return report;
}

}  // namespace archetide
