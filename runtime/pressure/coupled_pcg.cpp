#include "runtime/pressure/coupled_pcg.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// A round that does not reduce the true residual by at least this factor has met the limit of
// round-off.
constexpr double kStagnation = 0.9;

// What the cycle may leave out of A_water^-1 r, as a share of its square in the energy norm.
constexpr double kUnseen = 0.01;

// The estimate of the bodies' error is too large by 1.4 to 3, its square by this and more (16 and
// 48 bodies at density ratios 0.05 to 1, one at 1e-3, 64^3 and 128^3, against solves to 1e-12).
constexpr double kTooLarge = 2.0;

// f(place in the padded layout, cell of the grid, count) for each row of a region
template <class F>
void for_rows(const CoupledOperator& op, const PaddedLayout& l, const Blocks& region, F&& f) {
  const PoissonMatrix& a = op.water().matrix();
  for (const Blocks::Range& range : region.ranges) {
    const Vec3i at = a.cell(static_cast<std::int64_t>(range.begin));
    f(l(at[0], at[1], at[2]), range.begin, range.end - range.begin);
  }
}

}  // namespace

void CoupledPcg::setup(const CoupledOperator& op, Multigrid& cycle, Deflation& deflation) {
  op_ = &op, cycle_ = &cycle, deflation_ = &deflation;
  const PaddedLayout& l = cycle.layout();
  steps_.setup(op.water(), l);
  r_.resize(op.size());
  q_.resize(op.size());
  p_.assign(l.size, 0.0f);
  const PoissonMatrix& a = op.water().matrix();
  place_.resize(op.bodies().size());
  momentum_.resize(op.bodies().size());
  response_.resize(op.bodies().size());
  error_.resize(op.bodies().size());
  for_each_large(place_.size(), [&](std::size_t b) {
    const CoupledOperator::Body& body = op.bodies()[b];
    const MatX &M = body.added_mass, I = MatX::Identity(M.rows(), M.cols());
    const MatX inverse = op.own_inverse(b), both = inverse * (I + M * inverse).inverse();
    error_[b] = both * M * both;
    place_[b].clear();
    for (const std::int64_t n : body.cell) {
      const Vec3i c = a.cell(n);
      place_[b].push_back(l(c[0], c[1], c[2]));
    }
  });
}

SolveReport CoupledPcg::solve(const double* b, double* x, const CoupledPcgOptions& options) {
  const Stopwatch watch;
  options_ = options;
  report_ = {};
  const double norm_b = norm_in_range(b);
  if (norm_b == 0.0) fill(op_->blocks(), 0.0, x);
  target_ = std::fmax(options.tolerance * norm_b, options.absolute);
  energy_target_ = 0.0;
  find_still_parts(b, x);

  // Each round starts from the true residual; a round that ends early was the recursion's error.
  double residual = first_residual(b, x, norm_b);
  while (residual > target_ && report_.iterations < options.max_iterations) {
    const double before = residual;
    if (!deflation_->empty()) {
      start_deflated(residual, x);
      residual = true_residual(b, x);
    }
    iterate(b, x, residual);
    residual = true_residual(b, x);
    if (!(residual < kStagnation * before)) break;
  }
  op_->project(x);
  report_.residual = norm_b > 0.0 ? residual / norm_b : residual;
  report_.converged = residual <= target_ || residual <= round_off(x);
  report_.solve_seconds = watch.wall();
  report_.solve_cpu_seconds = watch.cpu();
  return report_;
}

// Eq. C18a.
void CoupledPcg::find_still_parts(const double* b, double* x) {
  constexpr double kShare = 1e-2;  // of the residual that is left elsewhere
  still_.clear();
  const double most = kShare * target_ / std::sqrt(static_cast<double>(op_->size()));
  for (const Blocks& part : op_->closed().open_parts()) {
    double constant;
    if (!op_->stands_still(part, b, most, constant)) continue;
    fill(part, constant, x);
    still_.push_back(&part);
  }
}

void CoupledPcg::hold_still(double* r) const {
  for (const Blocks* part : still_) fill(*part, 0.0, r);
}

// z: padded.
void CoupledPcg::hold_still(float* z) const {
  for (const Blocks* part : still_)
    for_rows(*op_, cycle_->layout(), *part,
             [&](std::size_t at, std::size_t, std::size_t n) { std::fill_n(z + at, n, 0.0f); });
}

// |b| of its part in the range of A.
double CoupledPcg::norm_in_range(const double* b) {
  if (op_->closed().empty()) return std::sqrt(steps_.square(b));
  copy(op_->blocks(), b, r_.data());
  op_->project(r_.data());
  return std::sqrt(steps_.square(r_.data()));
}

// What rounding alone leaves of |b - A x|: a few units in the last place of the products that it
// sums.
double CoupledPcg::round_off(const double* x) {
  constexpr double kUnits = 4.0;
  const Array3<double>& diag = op_->water().matrix().diag;
  copy(op_->blocks(), x, q_.data());
  for (const Blocks::Range& range : op_->blocks().ranges)
    for (std::size_t n = range.begin; n < range.end; ++n) q_[n] *= diag[n];
  return kUnits * std::numeric_limits<double>::epsilon() * norm(op_->blocks(), q_.data());
}

// r = b - A x, returns |r|
double CoupledPcg::true_residual(const double* b, double* x) {
  double square = steps_.residual(b, x, r_.data());
  if (!still_.empty()) {
    hold_still(r_.data());
    square = steps_.square(r_.data());
  }
  if (op_->bodies().empty() && op_->closed().empty()) return std::sqrt(square);
  response_ = op_->gather(x);
  op_->respond(response_);
  op_->scatter(response_, -1.0, r_.data());
  op_->project(r_.data());
  return std::sqrt(steps_.square(r_.data()));
}

// The same for the first guess, which is often none.
double CoupledPcg::first_residual(const double* b, double* x, double norm_b) {
  if (!all_zero(op_->blocks(), x)) return true_residual(b, x);
  copy(op_->blocks(), b, r_.data());
  hold_still(r_.data());
  op_->project(r_.data());
  return norm_b;
}

// Fhat^T z of every body.
void CoupledPcg::gather(const float* z) {
  for_each_large(place_.size(),
                 [&](std::size_t b) { momentum_[b] = op_->gather(b, place_[b], z); });
}

// H^-1 of what was gathered.
void CoupledPcg::respond() {
  for_each_large(place_.size(), [&](std::size_t b) {
    const CoupledOperator::Body& body = op_->bodies()[b];
    if (!body.nodes) response_[b].noalias() = body.inverse_mass * momentum_[b];
  });
  op_->respond_nodes(momentum_, response_);
  op_->hold(momentum_, response_);
}

// q += sum F H^-1 F^T p, returns what it adds to p . q
double CoupledPcg::apply_bodies(const float* p, double* q) {
  gather(p);
  respond();
  op_->scatter(response_, 1.0, q);
  double work = 0.0;
  for (std::size_t b = 0; b < place_.size(); ++b) work += momentum_[b].dot(response_[b]);
  return work;
}

// x gets the part in span(Y) that it lacks, so that Y^T r = 0.
void CoupledPcg::start_deflated(double residual, double* x) {
  const double scale = std::ldexp(1.0, -std::ilogb(residual));
  std::fill(p_.begin(), p_.end(), 0.0f);
  gather(p_.data());
  respond();
  deflation_->correct(op_->water(), cycle_->layout(), r_.data(), scale, response_, p_.data());
  hold_still(p_.data());
  steps_.advance(1.0 / scale, p_.data(), x);
}

// z = V r in the cycle's iterate, both scaled; returns their product, and sets energy_.
double CoupledPcg::precondition(double scale) {
  const double work = op_->closed().empty() ? cycle_->cycle() : cycle_with_closed(scale);
  hold_still(cycle_->iterate());
  if (!op_->touches_bodies()) return work;
  gather(cycle_->iterate());
  energy_ = body_error(scale) + kUnseen * work / (scale * scale);
  if (deflation_->empty()) return work;
  respond();
  deflation_->correct(op_->water(), cycle_->layout(), r_.data(), scale, response_,
                      cycle_->iterate());
  hold_still(cycle_->iterate());
  return work;
}

// The cycle where the water has regions that no air touches: it does not see their constants, which
// are corrected exactly.
double CoupledPcg::cycle_with_closed(double scale) {
  const ClosedComponents& closed = op_->closed();
  const PaddedLayout& l = cycle_->layout();
  float *b = cycle_->rhs(), *z = cycle_->iterate();
  const auto add = [&](std::size_t c, float value, float* v) {
    for_rows(*op_, l, closed.cells(c), [&](std::size_t at, std::size_t, std::size_t n) {
      for (std::size_t i = 0; i < n; ++i) v[at + i] += value;
    });
  };
  for (std::size_t c = 0; c < closed.count(); ++c)
    add(c, static_cast<float>(-scale * closed.mean(c, r_.data())), b);
  cycle_->cycle();
  const VecX constant = scale * op_->closed_correction(r_.data());
  for (std::size_t c = 0; c < closed.count(); ++c) {
    double sum = 0.0;
    for_rows(*op_, l, closed.cells(c), [&](std::size_t at, std::size_t, std::size_t n) {
      for (std::size_t i = 0; i < n; ++i) sum += z[at + i];
    });
    add(c, static_cast<float>(constant[c] - sum / static_cast<double>(closed.size(c))), z);
  }
  return scale * steps_.work(r_.data(), z);
}

// The square of the error of the bodies' velocities, in the norm of the added mass, that r would
// leave, but for what the cycle does not see (C18).
double CoupledPcg::body_error(double scale) const {
  double sum = 0.0;
  for (std::size_t b = 0; b < error_.size(); ++b) {
    const VecX f = momentum_[b].head(error_[b].rows());
    sum += f.dot(error_[b] * f);
  }
  return sum / (kTooLarge * scale * scale);
}

// The second test: is the error of the bodies' velocities within the tolerance?
bool CoupledPcg::close_enough(const double* b, double* x) {
  if (!op_->touches_bodies()) return true;
  if (energy_target_ == 0.0) {
    constexpr double kLeastShare = 1e-3;
    steps_.advance(pending_, p_.data(), x);
    pending_ = 0.0;
    const CoupledOperator::Energies e = op_->energies(x, b, options_.y);
    const double energy = std::fmax(std::fmin(e.bodies, e.water), kLeastShare * e.water);
    energy_target_ = options_.tolerance * options_.tolerance * std::fmax(energy, 0.0);
  }
  return energy_ <= energy_target_;
}

// Conjugate gradients until the recursion's r meets both tests; returns |r|. Directions are scaled
// by `unit`, a power of two, to stay in the range of fp32.
double CoupledPcg::iterate(const double* b, double* x, double residual) {
  if (!(residual > 0.0) || !std::isfinite(residual)) return residual;
  const double unit = std::ldexp(1.0, -std::ilogb(residual));
  steps_.load(r_.data(), unit, cycle_->rhs());
  double scale = unit, rho = precondition(scale) / (scale * scale), beta = 0.0;
  pending_ = 0.0;
  while (report_.iterations < options_.max_iterations) {
    double curvature =
        steps_.direction(pending_, static_cast<float>(unit / scale), cycle_->iterate(),
                         static_cast<float>(beta), p_.data(), x, q_.data());
    pending_ = 0.0;
    curvature += apply_bodies(p_.data(), q_.data());
    ++report_.iterations;
    if (!(rho > 0.0) || !(curvature > 0.0))
      break;  // lost to rounding (or not definite): start anew
    pending_ = rho * unit / curvature;
    scale = std::ldexp(1.0, -std::ilogb(residual));
    residual =
        std::sqrt(steps_.residual_step(pending_, q_.data(), r_.data(), scale, cycle_->rhs()));
    if (!std::isfinite(residual)) break;
    if (residual == 0.0) break;
    const bool small = residual <= target_;
    if (small && (residual <= options_.absolute || close_enough(b, x))) break;
    const double next = precondition(scale) / (scale * scale);
    if (small && close_enough(b, x)) break;
    beta = next / rho;
    rho = next;
  }
  steps_.advance(pending_, p_.data(), x);
  pending_ = 0.0;
  return residual;
}

std::size_t CoupledPcg::bytes() const {
  return sizeof(double) * (r_.capacity() + q_.capacity()) + sizeof(float) * p_.capacity();
}

}  // namespace archetide
