#include "runtime/coupling/deflation.h"

#include <omp.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "runtime/coupling/flux_columns.h"
#include "runtime/numerics/fused_steps.h"
#include "runtime/numerics/lanes.h"
#include "runtime/numerics/multigrid.h"

namespace archetide {
namespace {

// Directions whose added mass is below this part of the body's own cost no iterations worth saving.
// (16 bodies at 0.3 in 64^3 and 128^3: 9 and 12 iterations with 0.5, 9 and 11 with 0.3 in the same
// time.)
constexpr double kKept = 0.3;
// A patch reaches beyond the body by this part of its extent, and at least so many cells. (16
// bodies at 0.3 in 128^3: 11 iterations with 0.2, 10 with 0.3 for 20 % more seconds.)
constexpr double kMargin = 0.2;
constexpr int kLeastMargin = 3;
// Columns beyond this are not worth their dense E.
constexpr int kMostColumns = 4000;

// The cells of `a` in a box as a matrix of their own; p = 0 on the cells around it.
void crop(const PoissonMatrix& a, const Vec3i& low, const Vec3i& size, PoissonMatrix& out) {
  out.nx = size[0], out.ny = size[1], out.nz = size[2];
  out.open_side.fill(true);  // closed sides of the tank have w = 0
  out.kind.resize(size[0], size[1], size[2]);
  out.diag.resize(size[0], size[1], size[2]);
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j) {
      const std::size_t from = a.kind.index(low[0], low[1] + j, low[2] + k);
      const std::size_t to = out.kind.index(0, j, k);
      std::copy_n(a.kind.data() + from, size[0], out.kind.data() + to);
      std::copy_n(a.diag.data() + from, size[0], out.diag.data() + to);
    }
  for (int d = 0; d < 3; ++d) {
    const Vec3i n = size + Vec3i::Unit(d);
    out.w[d].resize(n[0], n[1], n[2]);
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j)
        std::copy_n(&a.w[d](low[0], low[1] + j, low[2] + k), n[0], &out.w[d](0, j, k));
  }
}

// S with S S^T = H^-1 (semi-definite in contact).
MatX root(const MatX& inverse_mass) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(inverse_mass);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

// The V-cycle of a box around a body.
class Deflation::Local {
 public:
  Local(const CoupledOperator& op, const Patch& p) : body_(op.bodies()[p.body]), low_(p.low) {
    crop(op.water().matrix(), p.low, p.size, matrix_);
    water_.setup(matrix_);
    cycle_.setup(water_);
    std::fill_n(cycle_.rhs(), cycle_.layout().size, 0.0f);
    for (std::int64_t n : body_.cell) place_.push_back(place(op.water().matrix().cell(n)));
  }

  // V Fhat s, at place(cell)
  const float* respond(const VecX& s) {
    for (std::size_t m = 0; m < place_.size(); ++m)
      cycle_.rhs()[place_[m]] =
          static_cast<float>(body_.flux.col(static_cast<Eigen::Index>(m)).dot(s));
    cycle_.cycle();
    return cycle_.iterate();
  }
  // Fhat^T of the last response
  VecX added_momentum() { return gather_columns(body_.flux, place_, cycle_.iterate()); }
  std::size_t place(const Vec3i& cell) const {
    const Vec3i c = cell - low_;
    return cycle_.layout()(c[0], c[1], c[2]);
  }

 private:
  const CoupledOperator::Body& body_;
  Vec3i low_;
  PoissonMatrix matrix_;
  PoissonOperator water_;
  Multigrid cycle_;
  std::vector<std::size_t> place_;  // of the body's flux cells
};

Deflation::Patch Deflation::box_of(const CoupledOperator& op, std::size_t b) {
  const PoissonMatrix& a = op.water().matrix();
  Patch p;
  p.body = static_cast<int>(b);
  const CoupledOperator::Body& body = op.bodies()[b];
  if (body.cell.empty()) return p;
  const int margin =
      std::max(kLeastMargin, static_cast<int>(kMargin * (body.high - body.low).maxCoeff()));
  p.low = (body.low.array() - margin).max(0);
  p.size = (body.high.array() + margin).min(Eigen::Array3i(a.nx, a.ny, a.nz)).matrix() - p.low;
  const Vec3i end = p.low + p.size;
  for (int k = p.low[2]; k < end[2]; ++k) {
    p.first_run.push_back(p.runs.size());
    const auto& segments = op.water().rows().plane(k);
    for (std::size_t n = 0; n < segments.size(); ++n) {
      const Segment& s = segments[n];
      const int from = std::max(s.begin, p.low[0]), to = std::min(s.end, end[0]);
      if (s.j < p.low[1] || s.j >= end[1] || from >= to) continue;
      p.runs.push_back({from, s.j, k, to - from, n, p.cells});
      p.cells += to - from;
    }
  }
  p.first_run.push_back(p.runs.size());
  return p;
}

std::span<const Deflation::Run> Deflation::Patch::plane(int k) const {
  if (k < low[2] || k >= low[2] + size[2]) return {};
  const std::size_t from = first_run[k - low[2]], to = first_run[k - low[2] + 1];
  return {runs.data() + from, to - from};
}

// The directions of a body whose added mass M counts, as S' = S U with U eigenvectors of S^T M S: a
// rough M tells which.
Deflation::Light Deflation::light_directions(const CoupledOperator& op, const Patch& p) {
  const CoupledOperator::Body& body = op.bodies()[p.body];
  const MatX S = root(op.own_inverse(p.body));
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(S.transpose() * body.added_mass * S);
  const VecX& ratio = eigen.eigenvalues();
  const Eigen::Index kept = (ratio.array() > kKept).count();
  return {S * eigen.eigenvectors().rightCols(kept), ratio.maxCoeff()};
}

// Both in iterations without deflation, fitted to 64^3 and 128^3 with 1 to 48 bodies, r = 0 and 9,
// density ratio 1e-3 to 1 (saved: 81, 75, 20, 7, 7, 11, 9 measured, 67, 72, 20, 8, 8, 12, 13 here;
// cost of 48 bodies at 0.05, 16 at 0.3 and at 1: 19, 15, 11 measured, 16, 15, 11 here). At 64^3 and
// 96^3 16 bodies at 0.5 take the same time either way.
Deflation::Expectation Deflation::expect(std::size_t unknowns, const std::vector<Patch>& patches,
                                         const std::vector<Light>& light) {
  Expectation e;
  double largest = 0.0, directions = 0.0;
  for (std::size_t n = 0; n < patches.size(); ++n) {
    const auto kept = static_cast<double>(light[n].S.cols());
    const double share = static_cast<double>(patches[n].cells) / static_cast<double>(unknowns);
    largest = std::max(largest, light[n].ratio);
    directions += kept;
    e.cost += (1.8 * kept + (kept > 0.0 ? 24.0 : 0.0)) * share;  // a cycle each; every iteration
  }
  e.saved = std::min(16.0 * (std::sqrt(1.0 + largest) - 1.0), 2.5 * directions);
  return e;
}

void Deflation::setup(const CoupledOperator& op, DeflationChoice choice) {
  patches_.clear();
  columns_ = 0;
  if (choice == DeflationChoice::kNever) return;
  for (std::size_t b = 0; b < op.bodies().size(); ++b) {
    Patch p = box_of(op, b);
    if (p.cells > 0) patches_.push_back(std::move(p));
  }
  std::vector<Light> light;
  double directions = 0.0;
  for (const Patch& p : patches_) {
    light.push_back(light_directions(op, p));
    directions += static_cast<double>(light.back().S.cols());
  }
  const Expectation e = expect(op.water().unknowns(), patches_, light);
  // Where much is saved, a tie goes to fewer iterations (on small grids the cost is overestimated).
  const double worth = e.saved > 10.0 ? 0.4 : 1.5;
  const bool pays = choice == DeflationChoice::kAlways || e.saved > worth * e.cost;
  if (directions == 0.0 || directions > kMostColumns || !pays) return patches_.clear();
  // Few patches: one after the other, threads share the cycles of each.
  const bool many = static_cast<int>(patches_.size()) >= omp_get_max_threads();
#pragma omp parallel for schedule(dynamic) if (many)
  for (std::size_t n = 0; n < patches_.size(); ++n) fill(op, light[n].S, patches_[n]);
  std::erase_if(patches_, [](const Patch& p) { return p.columns == 0; });
  for (Patch& p : patches_) p.first = columns_, columns_ += p.columns;
  if (columns_ > 0) assemble(op);
}

// Y of one body: V F S Q, with Q the eigenvectors of S^T F^T V F S whose eigenvalues (added mass /
// body mass) count.
void Deflation::fill(const CoupledOperator& op, const MatX& S, Patch& p) {
  const auto dofs = S.cols();
  if (dofs == 0) return;
  Local local(op, p);
  std::vector<std::vector<float>> Z(dofs, std::vector<float>(p.cells + kLanes));
  MatX K(dofs, dofs);
  for (Eigen::Index c = 0; c < dofs; ++c) {
    const float* z = local.respond(S.col(c));
    K.col(c) = S.transpose() * local.added_momentum();
    for (const Run& run : p.runs)
      std::copy_n(z + local.place(Vec3i(run.i, run.j, run.k)), run.length, Z[c].data() + run.at);
  }
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(0.5 * (K + K.transpose()));
  p.columns = static_cast<int>((eigen.eigenvalues().array() > kKept).count());
  p.y.resize(p.cells * p.columns + kLanes);  // blocks go beyond
  MatX Q = eigen.eigenvectors().rightCols(p.columns);
  Q *= eigen.eigenvalues().tail(p.columns).cwiseInverse().asDiagonal();
  const Eigen::MatrixXf share = Q.cast<float>();
  for (const Run& run : p.runs)
    for (int c = 0; c < p.columns; ++c)
      for (int i = 0; i < run.length; i += kLanes) {
        Lanes sum = {}, z;
        for (Eigen::Index d = 0; d < dofs; ++d) {
          read_block(Z[d].data() + run.at + i, z);
          sum += share(d, c) * z;
        }
        write_block(sum, p.column(run, c) + i);
      }
}

// E = Y^T A Y
void Deflation::assemble(const CoupledOperator& op) {
  MatX E = MatX::Zero(columns_, columns_);
  std::vector<std::pair<Patch*, int>> column;
  for (Patch& p : patches_) {
    find_flux(op, p);
    for (int c = 0; c < p.columns; ++c) column.emplace_back(&p, c);
  }
#pragma omp parallel for schedule(dynamic)
  for (std::size_t n = 0; n < column.size(); ++n)
    add_product(op, *column[n].first, column[n].second, E);
  // Y^T F H^-1 F^T Y, body by body
  std::vector<Near> near(op.bodies().size());
  for (const Patch& p : patches_)
    for (const auto& [c, flux] : p.flux) near[c].push_back({&p, &flux});
  for (std::size_t c = 0; c < near.size(); ++c)
    for (const auto& [p, flux] : near[c])
      for (const auto& [o, other] : near[c])
        E.block(p->first, o->first, p->columns, o->columns).noalias() +=
            flux->transpose() * op.bodies()[c].inverse_mass * *other;
  if (op.rows()) add_rows(op, near, E);
  factor_.compute(0.5 * (E + E.transpose()));
  if (factor_.info() != Eigen::Success) patches_.clear(), columns_ = 0;
}

// What rows take away from Y^T F H^-1 F^T Y: bodies that they tie together answer for each other.
void Deflation::add_rows(const CoupledOperator& op, const std::vector<Near>& near, MatX& E) const {
  for (const Patch& p : patches_) {
    std::vector<MatX> free(op.bodies().size());
    for (const int c : op.rows()->bodies())
      free[c] = MatX::Zero(op.bodies()[c].flux.rows(), p.columns);
    for (const auto& [c, flux] : p.flux) free[c] = op.bodies()[c].inverse_mass * flux;
    std::vector<MatX> held = free;
    op.rows()->constrain(held);
    for (const int c : op.rows()->bodies())
      for (const auto& [o, other] : near[c])
        E.block(o->first, p.first, o->columns, p.columns).noalias() +=
            other->transpose() * (held[c] - free[c]);
  }
}

// Products of the columns of a patch with numbers on its cells: fp32 in a plane, fp64 over planes.
class Deflation::Dots {
 public:
  explicit Dots(const Patch& p) : patch_(p), lanes_(p.columns), sums_(VecX::Zero(p.columns)) {}

  /// Adds those of cells skip, skip + 1, .. of a run with n numbers, after which 0 follows for a
  /// block.
  void add(const Run& run, int skip, const float* numbers, int n) {
    if (run.k != plane_) flush(), plane_ = run.k;
    for (int c = 0; c < patch_.columns; ++c) {
      const float* y = patch_.column(run, c) + skip;
      Lanes sum = lanes_[c];
      for (int i = 0; i < n; i += kLanes) {
        Lanes a, b;
        read_block(y + i, a), read_block(numbers + i, b);
        sum += a * b;
      }
      lanes_[c] = sum;
    }
  }
  const VecX& sums() {
    flush();
    return sums_;
  }

 private:
  void flush() {
    for (int c = 0; c < patch_.columns; ++c) {
      double sum = 0.0;
      for (int l = 0; l < kLanes; ++l) sum += lanes_[c][l];
      sums_[c] += sum, lanes_[c] = Lanes{};
    }
  }

  const Patch& patch_;
  int plane_ = -1;
  std::vector<Lanes> lanes_;
  VecX sums_;
};

// The bodies with cells in the box of p or next to it.
void Deflation::find_flux(const CoupledOperator& op, Patch& p) {
  const PoissonMatrix& a = op.water().matrix();
  const Vec3i low = p.low - Vec3i::Ones(), size = p.size + Vec3i::Constant(2);
  for (std::size_t c = 0; c < op.bodies().size(); ++c) {
    const auto& cells = op.bodies()[c].cell;
    const bool near = std::any_of(cells.begin(), cells.end(), [&](std::int64_t n) {
      const Vec3i at = a.cell(n) - low;
      return (at.array() >= 0).all() && (at.array() < size.array()).all();
    });
    if (near) p.flux.emplace_back(c, MatX::Zero(op.bodies()[c].flux.rows(), p.columns));
  }
}

// One column of E from the water, Y^T (A_water y), and Fhat^T y, for column c of p, y.
void Deflation::add_product(const CoupledOperator& op, Patch& p, int c, MatX& E) const {
  const PoissonMatrix& a = op.water().matrix();
  // y on the box and one cell around it
  const Vec3i low = p.low - Vec3i::Ones(), size = p.size + Vec3i::Constant(2), high = low + size;
  const PaddedLayout box(low.data(), size.data());
  std::vector<float> y(box.size, 0.0f), numbers(a.nx + kLanes);
  std::vector<double> product(a.nx);
  for (const Run& run : p.runs)
    std::copy_n(p.column(run, c), run.length, y.data() + box(run.i, run.j, run.k));
  for (auto& [b, flux] : p.flux) {
    const CoupledOperator::Body& body = op.bodies()[b];
    for (std::size_t m = 0; m < body.cell.size(); ++m) {
      const Vec3i at = a.cell(body.cell[m]);
      if ((at.array() < low.array()).any() || (at.array() >= high.array()).any()) continue;
      flux.col(c) += static_cast<double>(y[box(at[0], at[1], at[2])]) *
                     body.flux.col(static_cast<Eigen::Index>(m));
    }
  }
  for (const Patch& other : patches_) {
    if (((other.low + other.size).array() <= low.array()).any() ||
        (other.low.array() >= high.array()).any())
      continue;
    Dots dots(other);
    for (int k = low[2]; k < high[2]; ++k)
      for (const Run& run : other.plane(k)) {
        const int begin = std::max(run.i, low[0]), end = std::min(run.i + run.length, high[0]);
        if (run.j < low[1] || run.j >= high[1] || begin >= end) continue;
        product_row(op.water(), box, k, run.segment, begin, end, y.data(), product.data());
        std::copy_n(product.begin(), end - begin, numbers.begin());
        std::fill_n(numbers.begin() + (end - begin), kLanes, 0.0f);
        dots.add(run, begin - run.i, numbers.data(), end - begin);
      }
    E.col(p.first + c).segment(other.first, other.columns) += dots.sums();
  }
}

void Deflation::correct(const PoissonOperator& water, const PaddedLayout& layout, const double* r,
                        double scale, const std::vector<VecX>& response, float* z) {
  constexpr int kPlanes = 8;  // that a thread takes at once
  std::vector<std::pair<const Patch*, int>> piece;
  for (const Patch& p : patches_)
    for (int k = p.low[2]; k < p.low[2] + p.size[2]; k += kPlanes) piece.emplace_back(&p, k);
  std::vector<VecX> sums(piece.size());
#pragma omp parallel for schedule(dynamic)
  for (std::size_t n = 0; n < piece.size(); ++n) {
    const auto& [p, k] = piece[n];
    sums[n] = gather(water, layout, *p, k, k + kPlanes, r, scale, z);
  }
  weight_.setZero(columns_);
  for (std::size_t n = 0; n < piece.size(); ++n)
    weight_.segment(piece[n].first->first, piece[n].first->columns) += sums[n];
  for (const Patch& p : patches_)
    for (const auto& [c, flux] : p.flux)
      weight_.segment(p.first, p.columns).noalias() -= flux.transpose() * response[c];
  factor_.solveInPlace(weight_);
  const Eigen::VectorXf share = weight_.cast<float>();
  // Patches overlap: plane by plane.
#pragma omp parallel for schedule(dynamic)
  for (int k = layout.low[2]; k < layout.low[2] + layout.nz; ++k)
    for (const Patch& p : patches_) scatter(layout, p, k, share.data() + p.first, z);
}

// What planes k to end - 1 add to the patch's entries of Y^T (scale r - A_water z).
VecX Deflation::gather(const PoissonOperator& water, const PaddedLayout& layout, const Patch& p,
                       int k, int end, const double* r, double scale, const float* z) {
  const PoissonMatrix& a = water.matrix();
  thread_local std::vector<double> product;
  thread_local std::vector<float> residual;
  product.resize(a.nx), residual.resize(a.nx + kLanes);
  Dots dots(p);
  for (; k < end; ++k)
    for (const Run& run : p.plane(k)) {
      product_row(water, layout, run.k, run.segment, run.i, run.i + run.length, z, product.data());
      const double* rr = r + a.kind.index(run.i, run.j, run.k);
      for (int i = 0; i < run.length; ++i)
        residual[i] = static_cast<float>(scale * rr[i] - product[i]);
      std::fill_n(residual.begin() + run.length, kLanes, 0.0f);
      dots.add(run, 0, residual.data(), run.length);
    }
  return dots.sums();
}

// z += the patch's columns, each times its share, in plane k
void Deflation::scatter(const PaddedLayout& layout, const Patch& p, int k, const float* share,
                        float* z) {
  for (const Run& run : p.plane(k)) {
    float* row = z + layout(run.i, run.j, run.k);
    for (int i = 0; i < run.length; i += kLanes) {
      Lanes old, sum, y;
      read_block(row + i, old);
      sum = old;
      for (int c = 0; c < p.columns; ++c) {
        read_block(p.column(run, c) + i, y);
        sum += share[c] * y;
      }
      Choice inside;
      stretch(0, run.length - i, inside);
      inside.select(sum, old, sum);
      write_block(sum, row + i);
    }
  }
}

std::size_t Deflation::bytes() const {
  std::size_t total = sizeof(double) * static_cast<std::size_t>(columns_) * columns_;
  for (const Patch& p : patches_) {
    total += p.runs.capacity() * sizeof(Run);
    total += p.y.capacity() * sizeof(float);
  }
  return total;
}

}  // namespace archetide
