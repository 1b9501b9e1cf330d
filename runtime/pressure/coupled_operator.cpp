#include "runtime/pressure/coupled_operator.h"

#include <omp.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "runtime/cut_cells/flux_columns.h"
#include "runtime/cut_cells/lost_flux.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

// Added mass = this x extent in cells x Fhat Fhat^T (spheres and blobs of 6 to 60 cells in extent:
// up to a third off; measured).
constexpr double kAddedMass = 0.11;

double CoupledBody::pushed(std::size_t m, const VecX& at) const {
  const auto column = flux.flux.col(static_cast<Eigen::Index>(m));
  if (!nodes) return column.dot(at);
  return column.dot(at.head(column.size())) +
         flux.surface.pushed(m, at.tail(at.size() - column.size()));
}

std::vector<VecX> answers(const std::vector<CoupledBody>& bodies, const std::vector<VecX>& f) {
  std::vector<VecX> y(bodies.size());
  std::vector<const NodalInverse*> inverses;
  std::vector<MatX> nodal;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b].nodes)
      inverses.push_back(&bodies[b].nodes->inverse()), nodal.push_back(f[b]);
    else
      y[b] = bodies[b].inverse_mass * f[b];
  if (nodal.empty()) return y;
  NodalInverse::solve(inverses, nodal);
  auto next = nodal.begin();
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (bodies[b].nodes) y[b] = *next++;
  return y;
}

std::vector<VecX> answers(const std::vector<CoupledBody>& bodies, const std::vector<VecX>& f,
                          const ConstrainedInverse* rows) {
  std::vector<VecX> y = answers(bodies, f);
  const auto of_nodes = [&](int b) { return bodies[b].nodes ? bodies[b].nodes->rows() : nullptr; };
  const auto whole = [](const RowAnswers& r) -> const MatX& { return r.whole; };
  if (rows) constrain_responses(*rows, of_nodes, whole, 1.0, f, y);
  return y;
}

MatX CoupledOperator::Body::gather(const MatX& values) const {
  if (!nodes) return flux * values;
  MatX f = MatX::Zero(rows(), values.cols());
  f.topRows(flux.rows()).noalias() = flux * values;
  for (Eigen::Index k = 0; k < values.cols(); ++k)
    surface.gather([&](std::size_t m) { return values(static_cast<Eigen::Index>(m), k); },
                   f.col(k).tail(rows() - flux.rows()));
  return f;
}

CoupledOperator::Body CoupledOperator::body_of(const Grid& g, const PressureSystem& s,
                                               double density, const CoupledBody& coupled) {
  const BodyFlux& f = coupled.flux;
  const double area = g.dx * g.dx, mass = density * g.dx * g.dx * g.dx;
  Body body;
  body.low = Vec3i(s.matrix.nx, s.matrix.ny, s.matrix.nz);
  body.flux.resize(f.flux.rows(), f.flux.cols());
  std::vector<std::size_t> ascending(f.cell.size());
  std::iota(ascending.begin(), ascending.end(), std::size_t{0});
  std::sort(ascending.begin(), ascending.end(),
            [&](std::size_t a, std::size_t b) { return f.cell[a] < f.cell[b]; });
  for (const std::size_t m : ascending) {
    if (!holds_unknown(s.matrix, f.cell[m])) continue;
    body.flux.col(static_cast<Eigen::Index>(body.cell.size())) =
        f.flux.col(static_cast<Eigen::Index>(m)) / area;
    body.cell.push_back(f.cell[m]);
    if (coupled.nodes) {
      for (std::size_t e = f.surface.begin(m); e < f.surface.ends[m]; ++e)
        body.surface.add(f.surface.vertex[e], f.surface.area[e] / area);
      body.surface.end_column();
    }
    const Vec3i at = s.matrix.cell(f.cell[m]);
    body.low = body.low.cwiseMin(at), body.high = body.high.cwiseMax(at + Vec3i::Ones());
  }
  body.flux.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(body.cell.size()));
  body.inverse_mass = mass * coupled.inverse_mass;
  body.nodes = coupled.nodes;
  body.added_mass =
      kAddedMass * (body.high - body.low).maxCoeff() * (body.flux * body.flux.transpose());
  return body;
}

void CoupledOperator::setup_water(const PressureSystem& s) {
  water_.setup(s.matrix);
  closed_.setup(water_);
  surface_weight_ = &s.surface_weight;
}

bool CoupledOperator::stands_still(const Blocks& part, const double* b, double most,
                                   double& constant) const {
  const double* weight = surface_weight_->data();
  double sum = 0.0, weights = 0.0;
  for (const Blocks::Range& range : part.ranges)
    for (std::size_t n = range.begin; n < range.end; ++n) {
      if (weight[n] == 0.0 && !(std::abs(b[n]) <= most)) return false;
      sum += b[n], weights += weight[n];
    }
  constant = weights > 0.0 ? sum / weights : 0.0;
  for (const Blocks::Range& range : part.ranges)
    for (std::size_t n = range.begin; n < range.end; ++n)
      if (!(std::abs(b[n] - constant * weight[n]) <= most)) return false;
  const auto holds = [&](std::int64_t cell) { return part.holds(static_cast<std::size_t>(cell)); };
  return std::none_of(bodies_.begin(), bodies_.end(), [&](const Body& body) {
    return std::any_of(body.cell.begin(), body.cell.end(), holds);
  });
}

void CoupledOperator::setup(const Grid& g, const PressureSystem& s, double density,
                            const std::vector<CoupledBody>& bodies, const ConstrainedInverse* rows,
                            bool same_water) {
  rows_ = rows && !rows->empty() ? rows : nullptr;
  to_scaled_mass_ = density * g.dx * g.dx * g.dx;
  if (same_water) {  // what it sees of them is the same too
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      bodies_[b].inverse_mass = to_scaled_mass_ * bodies[b].inverse_mass;
      bodies_[b].nodes = bodies[b].nodes;
    }
  } else {
    bodies_.assign(bodies.size(), {});
    for_each_large(bodies.size(),
                   [&](std::size_t b) { bodies_[b] = body_of(g, s, density, bodies[b]); });
    share_cells();
  }
  setup_closed_regions();
}

void CoupledOperator::share_cells() {
  constexpr std::size_t kEvery = 16;  // is looked at
  std::vector<std::int64_t> cells;
  for (const Body& body : bodies_)
    for (std::size_t m = 0; m < body.cell.size(); m += kEvery) cells.push_back(body.cell[m]);
  std::sort(cells.begin(), cells.end());
  constexpr std::size_t kFew = 64;  // are not worth a thread to be started
  const std::size_t parts = cells.size() < kFew ? 1 : omp_get_max_threads();
  part_.assign(parts + 1, std::numeric_limits<std::int64_t>::max());
  part_[0] = 0;
  for (std::size_t t = 1; t < parts; ++t) part_[t] = cells[t * cells.size() / parts];
}

bool CoupledOperator::touches_bodies() const {
  return std::any_of(bodies_.begin(), bodies_.end(),
                     [](const Body& body) { return !body.cell.empty(); });
}

void CoupledOperator::setup_closed_regions() {
  const auto n = static_cast<Eigen::Index>(closed_.count());
  null_vectors_.resize(n, 0);
  closed_inverse_.resize(n, n);
  if (n == 0) return;

  // E^T A E: only the bodies' part acts on constants.
  MatX G = MatX::Zero(n, n);
  double scale = 0.0;
  std::vector<double> indicator(size(), 0.0);
  std::vector<MatX> pushed, free;  // Fhat^T E of every body, and H^-1 of it
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    MatX sums(body.rows(), n);
    for (Eigen::Index c = 0; c < n; ++c) {
      const double one = 1.0 / std::sqrt(static_cast<double>(closed_.size(c)));
      closed_.add_constant(c, one, indicator.data());
      sums.col(c) = gather(b, indicator.data());
      closed_.add_constant(c, -one, indicator.data());
      scale = std::max(scale, one * one *
                                  (body.flux.transpose() * body.inverse_mass)
                                      .cwiseProduct(body.flux.transpose())
                                      .sum());
    }
    free.push_back(respond_alone(b, sums));
    if (body.nodes)
      G.noalias() += sums.transpose() * free.back();
    else
      G.noalias() += sums.transpose() * body.inverse_mass * sums;
    pushed.push_back(std::move(sums));
  }
  if (rows_) {
    std::vector<MatX> held = free;
    hold(pushed, held);
    for (const int b : rows_->bodies()) G.noalias() += pushed[b].transpose() * (held[b] - free[b]);
    G = 0.5 * (G + G.transpose()).eval();
  }
  // A direction whose stiffness is round-off of the bodies' total is null.
  constexpr double kNull = 1e-12;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(G);
  closed_inverse_.setZero();
  for (Eigen::Index e = 0; e < n; ++e) {
    const VecX v = eigen.eigenvectors().col(e);
    if (eigen.eigenvalues()[e] > kNull * scale) {
      closed_inverse_ += v * v.transpose() / eigen.eigenvalues()[e];
    } else {
      null_vectors_.conservativeResize(Eigen::NoChange, null_vectors_.cols() + 1);
      null_vectors_.rightCols<1>() = v;
    }
  }
}

namespace {

/// Reduced forces on a body of nodes, and those on its vertices.
template <class Place, class Value>
VecX with_surface(const CoupledOperator::Body& body, const VecX& reduced,
                  const std::vector<Place>& place, const Value* x) {
  VecX f = VecX::Zero(body.rows());
  f.head(reduced.size()) = reduced;
  body.surface.gather([&](std::size_t m) { return static_cast<double>(x[place[m]]); },
                      f.tail(f.size() - reduced.size()));
  return f;
}

}  // namespace

VecX CoupledOperator::gather(std::size_t b, const double* x) const {
  const Body& body = bodies_[b];
  VecX reduced = gather_columns(body.flux, body.cell, x);
  return body.nodes ? with_surface(body, reduced, body.cell, x) : reduced;
}

VecX CoupledOperator::gather(std::size_t b, const std::vector<std::size_t>& place,
                             const float* x) const {
  const Body& body = bodies_[b];
  VecX reduced = gather_columns(body.flux, place, x);
  return body.nodes ? with_surface(body, reduced, place, x) : reduced;
}

void CoupledOperator::scatter(const std::vector<VecX>& v, double factor, double* y) const {
  const auto add = [&](const Body& body, const VecX& at, std::size_t first, std::size_t end) {
    if (!body.nodes) return scatter_columns(body.flux, body.cell, first, end, factor * at, y);
    const Eigen::Index reduced = body.flux.rows();
    scatter_columns(body.flux, body.cell, first, end, factor * at.head(reduced), y);
    const VecX at_vertices = factor * at.tail(at.size() - reduced);
    for (std::size_t m = first; m < end; ++m)
      y[body.cell[m]] += body.surface.pushed(m, at_vertices);
  };
  const std::size_t parts = part_.size() - 1;
  for_each_large(parts, [&](std::size_t t) {
    const auto place = [](const Body& body, std::int64_t cell) -> std::size_t {
      return std::lower_bound(body.cell.begin(), body.cell.end(), cell) - body.cell.begin();
    };
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      add(bodies_[b], v[b], place(bodies_[b], part_[t]), place(bodies_[b], part_[t + 1]));
  });
}

template <class Matrix>
void CoupledOperator::hold(const std::vector<Matrix>& f, std::vector<Matrix>& response) const {
  const auto of_nodes = [&](int b) {
    return bodies_[b].nodes ? bodies_[b].nodes->rows() : nullptr;
  };
  const auto in_solve = [](const RowAnswers& r) -> const MatX& { return r.in_solve; };
  if (rows_) constrain_responses(*rows_, of_nodes, in_solve, to_scaled_mass_, f, response);
}
template void CoupledOperator::hold(const std::vector<VecX>& f, std::vector<VecX>& response) const;
template void CoupledOperator::hold(const std::vector<MatX>& f, std::vector<MatX>& response) const;

// Eqs. 42 and 43 with λ eliminated: H⁻¹ f; with joints Eq. 49.
void CoupledOperator::respond(std::vector<VecX>& f) const {
  const std::vector<VecX> force = rows_ ? f : std::vector<VecX>();
  respond_nodes(f, f);
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (!bodies_[b].nodes) f[b] = (bodies_[b].inverse_mass * f[b]).eval();
  hold(force, f);
}

void CoupledOperator::respond_nodes(const std::vector<VecX>& f, std::vector<VecX>& response) const {
  std::vector<std::size_t> which;
  std::vector<const NodalBody*> nodes;
  std::vector<MatX> all;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (!bodies_[b].nodes) continue;
    if (bodies_[b].cell.empty()) {
      response[b] = VecX::Zero(bodies_[b].rows());
      continue;
    }
    which.push_back(b), nodes.push_back(bodies_[b].nodes.get()), all.push_back(f[b]);
  }
  if (which.empty()) return;
  NodalBody::answer_in_solve(nodes, all);
  for (std::size_t n = 0; n < which.size(); ++n) response[which[n]] = to_scaled_mass_ * all[n];
}

MatX CoupledOperator::respond_alone(std::size_t b, const MatX& f) const {
  const Body& body = bodies_[b];
  if (!body.nodes) return body.inverse_mass * f;
  std::vector<MatX> one = {f};
  NodalBody::answer_in_solve({body.nodes.get()}, one);
  return to_scaled_mass_ * one[0];
}

VecX CoupledOperator::on_body(std::size_t b, const VecX& f) const {
  return bodies_[b].nodes ? VecX(bodies_[b].nodes->surface().to_body(f)) : f;
}

MatX CoupledOperator::own_inverse(std::size_t b) const {
  const int body = static_cast<int>(b);
  if (!rows_ || !rows_->touches(body)) return bodies_[b].inverse_mass;
  if (bodies_[b].nodes) {
    const RowAnswers& rows = *bodies_[b].nodes->rows();
    const MatX reduced = rows.in_solve.topRows(bodies_[b].flux.rows()).transpose();
    return bodies_[b].inverse_mass - to_scaled_mass_ * rows_->own_loss(body, reduced);
  }
  return to_scaled_mass_ * rows_->own_block(body);
}

std::vector<VecX> CoupledOperator::gather(const double* x) const {
  std::vector<VecX> f(bodies_.size());
  for_each_large(bodies_.size(), [&](std::size_t b) { f[b] = gather(b, x); });
  return f;
}

// Eq. 45 with λ eliminated: y = (Gᵀ e β⁻¹ G + F H⁻¹ Fᵀ) x.
void CoupledOperator::apply(const double* x, double* y) const {
  water_.apply(x, y);
  std::vector<VecX> f = gather(x);
  respond(f);
  scatter(f, 1.0, y);
}

// Root of the number of cells of each closed region: constants over it have norm 1.
VecX CoupledOperator::closed_norms() const {
  VecX norm(closed_.count());
  for (std::size_t c = 0; c < closed_.count(); ++c)
    norm[c] = std::sqrt(static_cast<double>(closed_.size(c)));
  return norm;
}

// Of v, per closed region: the coefficient of the constant of norm 1.
VecX CoupledOperator::along_constants(const double* v) const {
  VecX sums = closed_norms();
  for (std::size_t c = 0; c < closed_.count(); ++c) sums[c] *= closed_.mean(c, v);
  return sums;
}

// The part of that along the null space.
VecX CoupledOperator::null_part(const double* v) const {
  return null_vectors_ * (null_vectors_.transpose() * along_constants(v));
}

void CoupledOperator::project(double* v) const {
  if (null_vectors_.cols() == 0) return;
  const VecX remove = null_part(v).cwiseQuotient(closed_norms());
  for (std::size_t c = 0; c < closed_.count(); ++c) closed_.add_constant(c, -remove[c], v);
}

double CoupledOperator::incompatible(const double* v) const {
  if (null_vectors_.cols() == 0) return 0.0;
  return null_part(v).cwiseProduct(closed_norms()).cwiseAbs().maxCoeff();
}

VecX CoupledOperator::closed_correction(const double* r) const {
  return (closed_inverse_ * along_constants(r)).cwiseQuotient(closed_norms());
}

void CoupledOperator::add_closed_correction(const double* r, double* z) const {
  if (closed_.empty()) return;
  const VecX add = closed_correction(r);
  for (std::size_t c = 0; c < closed_.count(); ++c) closed_.add_constant(c, add[c], z);
}

CoupledOperator::Energies CoupledOperator::energies(const double* x, const double* b,
                                                    const std::vector<VecX>& y) const {
  const std::vector<VecX> f = gather(x);
  std::vector<VecX> response = f;
  respond(response);
  Energies e;
  e.water = dot(blocks(), x, b);
  for (std::size_t n = 0; n < bodies_.size(); ++n) {
    const VecX v = y[n].head(bodies_[n].flux.rows()) - response[n].head(bodies_[n].flux.rows());
    e.water -= f[n].dot(response[n]);
    e.bodies += v.dot(bodies_[n].added_mass * v);
  }
  return e;
}

}  // namespace archetide
