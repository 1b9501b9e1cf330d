#include "runtime/pressure/deflation.h"

#include <omp.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/base/exception_carrier.h"
#include "runtime/numerics/aligned.h"
#include "runtime/numerics/box_cycle.h"
#include "runtime/numerics/fused_steps.h"
#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// Directions whose added mass is below this part of the body's own cost no iterations worth saving.
// (16 bodies in 128^3, density ratio 1 and 0.3: 11 and 12 iterations with 0.3 and with 0.6, which
// takes less memory.)
constexpr double kKept = 0.6;
// A patch reaches beyond the body by this part of its extent, at least and at most so many cells.
// (16 bodies at 0.3: in 128^3 13 iterations with 5 cells, 12 with 6; in 192^3 14 with 6, 13 with 9
// in a tenth more time.)
constexpr double kMargin = 0.2;
constexpr int kLeastMargin = 3, kMostMargin = 6;
// It is built where the iterations that it saves are expected to be this part of its cost: the cost
// is overestimated on small grids, and a tie goes to fewer iterations.
constexpr double kWorth = 0.65;
// Less is saved where the pressure of the last step is the first guess: of the rings of tori15 in
// 384 x 384 x 128 at 1e-4, 1e-6, 1e-8 1, 2, 2 iterations while they fall in (expected 6, 10, 13),
// 2 to 3 and 6 under water (8, 16). With this part 15 rings of a tenth of their weight keep theirs.
constexpr double kWarm = 0.4;
// Columns beyond this are not worth their dense E.
constexpr int kMostColumns = 4000;

// S with S S^T = H^-1 (semi-definite in contact).
MatX root(const MatX& inverse_mass) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(inverse_mass);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

// What a thread needs to fill patches.
struct Deflation::Local {
  BoxCycle cycle;
  AlignedFloats responses;  // V Fhat S: kLanes columns after kLanes columns, a block a cell
};

Deflation::Patch Deflation::box_of(const CoupledOperator& op, std::size_t b) {
  const PoissonMatrix& a = op.water().matrix();
  Patch p;
  p.body = static_cast<int>(b);
  const CoupledOperator::Body& body = op.bodies()[b];
  if (body.cell.empty()) return p;
  const double extent = (body.high - body.low).maxCoeff();
  const int margin = std::clamp(static_cast<int>(kMargin * extent), kLeastMargin, kMostMargin);
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

// Both in iterations without deflation, fitted to 64^3, 128^3 and 192^3 with 1 to 48 bodies, r = 0
// and 9, density ratio 1e-3 to 1. In 192^3 at 1e-6 16 bodies at 1, 0.5 and 0.3, 48 at 0.05, 4 at
// 0.1 and 16 rigid ones at 0.3 saved 8, 14, 23, 86, 31, 4 (here 8, 15, 22, 82, 29, 5) and cost 9,
// 14, 13, 12, 11, 5 (9, 12, 14, 11, 9, 5); on small grids the cost is overestimated. In 96^3 at
// 0.3 and 1e-4, 1e-6, 1e-8 one body saved 4, 6, 6 (4, 6, 8), two 8, 11, 15 (7, 10, 14), 16 of them
// 17, 24, 31 (15, 23, 31).
Deflation::Expectation Deflation::expect(std::size_t unknowns, const std::vector<Patch>& patches,
                                         const std::vector<Light>& light, double tolerance) {
  Expectation e;
  double directions = 0.0, largest = 0.0, sum = 0.0;
  e.cost = 2.0;
  for (std::size_t n = 0; n < patches.size(); ++n) {
    const auto kept = static_cast<double>(light[n].S.cols());
    const double share = static_cast<double>(patches[n].cells) / static_cast<double>(unknowns);
    const double own = std::sqrt(1.0 + light[n].ratio) - 1.0;
    largest = std::max(largest, own), sum += own, directions += kept;
    e.cost += (1.4 * kept + (kept > 0.0 ? 12.0 : 0.0)) * share;  // every iteration; cycles, E
  }
  if (directions == 0.0) return e;
  // Few bodies have few eigenvalues away from the water's, which conjugate gradients find.
  const double alike = sum / largest, spread = alike / (alike + 3.0);
  const double decades = -std::log10(std::min(tolerance, 0.1));
  e.saved = std::min(19.0 * spread * largest, 2.5 * directions) * decades / 6.0;
  return e;
}

bool Deflation::many_patches() const {
  return static_cast<int>(patches_.size()) >= omp_get_max_threads();
}

void Deflation::setup(const CoupledOperator& op, const Multigrid& water, DeflationChoice choice,
                      double tolerance, bool warm_start) {
  patches_.clear();
  columns_ = 0;
  if (choice == DeflationChoice::kNever) return;
  patches_.resize(op.bodies().size());
  for_each_large(patches_.size(), [&](std::size_t b) { patches_[b] = box_of(op, b); });
  std::erase_if(patches_, [](const Patch& p) { return p.cells == 0; });
  std::vector<Light> light(patches_.size());
  for_each_large(patches_.size(),
                 [&](std::size_t n) { light[n] = light_directions(op, patches_[n]); });
  double directions = 0.0;
  for (const Light& l : light) directions += static_cast<double>(l.S.cols());
  const Expectation e = expect(op.water().unknowns(), patches_, light, tolerance);
  const double saved = warm_start ? kWarm * e.saved : e.saved;
  const bool pays = choice == DeflationChoice::kAlways || saved > kWorth * e.cost;
  if (directions == 0.0 || directions > kMostColumns || !pays) return patches_.clear();
  if (many_patches()) {
    ExceptionCarrier carrier;
#pragma omp parallel
    {
      Local local;
#pragma omp for schedule(dynamic)
      for (std::size_t n = 0; n < patches_.size(); ++n)
        carrier.run([&] { fill(op, water, light[n].S, local, patches_[n]); });
    }
    carrier.rethrow();
  } else {  // outside of any parallel region: there threads would be made and ended for every loop
    Local local;
    for (std::size_t n = 0; n < patches_.size(); ++n)
      fill(op, water, light[n].S, local, patches_[n]);
  }
  std::erase_if(patches_, [](const Patch& p) { return p.columns == 0; });
  for (Patch& p : patches_) p.first = columns_, columns_ += p.columns;
  if (columns_ > 0) assemble(op);
}

// Y of one body: V F S Q, with Q the eigenvectors of S^T F^T V F S whose eigenvalues (added mass /
// body mass) count.
void Deflation::fill(const CoupledOperator& op, const Multigrid& water, const MatX& S, Local& local,
                     Patch& p) const {
  const Eigen::Index dofs = S.cols(), chunks = (dofs + kLanes - 1) / kLanes;
  if (dofs == 0) return;
  local.cycle.setup(water, p.low.data(), p.size.data());
  const CoupledOperator::Body& body = op.bodies()[p.body];
  const MatX pushed = body.flux.transpose() * S;  // flux cells x directions
  const auto place = [&](const Vec3i& c) { return local.cycle.place(c[0], c[1], c[2]); };
  std::vector<std::size_t> places;
  for (const std::int64_t n : body.cell) places.push_back(place(op.water().matrix().cell(n)));
  AlignedFloats& z = local.responses;  // chunk by chunk: a block a cell
  z.resize(chunks * p.cells * kLanes);
  MatX K(dofs, dofs);
  for (Eigen::Index chunk = 0; chunk < chunks; ++chunk) {
    const Eigen::Index first = chunk * kLanes, count = std::min<Eigen::Index>(kLanes, dofs - first);
    for (std::size_t m = 0; m < places.size(); ++m)
      for (Eigen::Index c = 0; c < kLanes; ++c)
        local.cycle.rhs()[places[m] + c] =
            c < count ? static_cast<float>(pushed(static_cast<Eigen::Index>(m), first + c)) : 0.0f;
    local.cycle.cycle();
    const float* response = local.cycle.iterate();
    MatX pushing(places.size(), count);  // the response at the flux cells
    for (std::size_t m = 0; m < places.size(); ++m)
      for (Eigen::Index c = 0; c < count; ++c)
        pushing(static_cast<Eigen::Index>(m), c) = response[places[m] + c];
    K.middleCols(first, count).noalias() = pushed.transpose() * pushing;
    for (const Run& run : p.runs)
      std::copy_n(response + place(Vec3i(run.i, run.j, run.k)), run.length * kLanes,
                  z.data() + (chunk * p.cells + run.at) * kLanes);
  }
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(0.5 * (K + K.transpose()));
  p.columns = static_cast<int>((eigen.eigenvalues().array() > kKept).count());
  p.y.resize(p.cells * p.columns + kLanes);  // blocks go beyond
  MatX Q = eigen.eigenvectors().rightCols(p.columns);
  Q *= eigen.eigenvalues().tail(p.columns).cwiseInverse().asDiagonal();
  for (int first = 0; first < p.columns; first += kLanes) {
    const int count = std::min(kLanes, p.columns - first);
    std::vector<Lanes> share(dofs, Lanes{});  // of each direction in the columns from `first` on
    for (Eigen::Index d = 0; d < dofs; ++d)
      for (int c = 0; c < count; ++c) share[d][c] = static_cast<float>(Q(d, first + c));
#pragma omp parallel for schedule(static) if (!many_patches())
    for (std::size_t n = 0; n < p.runs.size(); ++n) {
      const Run& run = p.runs[n];
      for (int i = 0; i < run.length; ++i) {
        Lanes sum = {};
        for (Eigen::Index d = 0; d < dofs; ++d)
          sum += z[(d / kLanes * p.cells + run.at + i) * kLanes + d % kLanes] * share[d];
        for (int c = 0; c < count; ++c) p.column(run, first + c)[i] = sum[c];
      }
    }
  }
}

// kLanes columns of a patch at once, a block a cell, on its box and two layers of cells around it;
// 0 off the patch's unknowns.
class Deflation::Spread {
 public:
  explicit Spread(const Patch& p)
      : patch_(p),
        low_(p.low - Vec3i::Constant(2)),
        sy_(p.size[0] + 4),
        sz_(sy_ * (p.size[1] + 4)),
        values_(sz_ * (p.size[2] + 4) * kLanes, 0.0f) {}

  void load(int first, int count) {
    for (const Run& run : patch_.runs) {
      float* to = values_.data() + place(run.i, run.j, run.k);
      for (int c = 0; c < kLanes; ++c) {
        const float* from = c < count ? patch_.column(run, first + c) : nullptr;
        for (int i = 0; i < run.length; ++i) to[i * kLanes + c] = from ? from[i] : 0.0f;
      }
    }
  }
  // The cells where they, or their products with A, may not be 0: [low, high)
  Vec3i low() const { return patch_.low - Vec3i::Ones(); }
  Vec3i high() const { return patch_.low + patch_.size + Vec3i::Ones(); }
  bool reaches(const Vec3i& cell) const {
    return (cell.array() >= low().array()).all() && (cell.array() < high().array()).all();
  }
  const float* at(int i, int j, int k) const { return values_.data() + place(i, j, k); }

  // A_water times them at n cells from (i, j, k) on, from differences: what is left of smooth
  // columns is small.
  void product(const PoissonMatrix& a, int i, int j, int k, int n, float* out) const {
    const double *x = &a.w[0](i, j, k), *south = &a.w[1](i, j, k), *north = &a.w[1](i, j + 1, k),
                 *down = &a.w[2](i, j, k), *up = &a.w[2](i, j, k + 1), *diag = &a.diag(i, j, k);
    const float* y = at(i, j, k);
    const std::ptrdiff_t row = sy_ * kLanes, plane = sz_ * kLanes;
    const std::ptrdiff_t step[6] = {-kLanes, kLanes, -row, row, -plane, plane};
    for (int m = 0; m < n; ++m, y += kLanes, out += kLanes) {
      const double w[6] = {x[m], x[m + 1], south[m], north[m], down[m], up[m]};
      double rest = diag[m];  // what the air beside takes
      for (const double face : w) rest -= face;
      Lanes here, sum;
      read_block(y, here);
      sum = static_cast<float>(rest) * here;
      for (int f = 0; f < 6; ++f) {
        Lanes beside;
        read_block(y + step[f], beside);
        sum += static_cast<float>(w[f]) * (here - beside);
      }
      write_block(sum, out);
    }
  }

 private:
  std::size_t place(int i, int j, int k) const {
    return (static_cast<std::size_t>(i - low_[0]) + sy_ * static_cast<std::size_t>(j - low_[1]) +
            sz_ * static_cast<std::size_t>(k - low_[2])) *
           kLanes;
  }

  const Patch& patch_;
  Vec3i low_;
  std::size_t sy_, sz_;  // blocks
  AlignedFloats values_;
};

// E = Y^T A Y
void Deflation::assemble(const CoupledOperator& op) {
  MatX E = MatX::Zero(columns_, columns_);
  for (Patch& p : patches_) find_flux(op, p);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (many_patches())
  for (std::size_t n = 0; n < patches_.size(); ++n)
    carrier.run([&] { add_products(op, patches_[n], E); });
  carrier.rethrow();
  E.triangularView<Eigen::StrictlyUpper>() = E.transpose();
  // Y^T F H^-1 F^T Y, body by body
  std::vector<Near> near(op.bodies().size());
  for (const Patch& p : patches_)
    for (const auto& [c, flux] : p.flux) near[c].push_back({&p, &flux});
  for (std::size_t c = 0; c < near.size(); ++c) {
    if (op.bodies()[c].nodes) {
      add_answers(op, c, near[c], E);
      continue;
    }
    for (const auto& [p, flux] : near[c])
      for (const auto& [o, other] : near[c])
        E.block(p->first, o->first, p->columns, o->columns).noalias() +=
            flux->transpose() * op.bodies()[c].inverse_mass * *other;
  }
  if (op.rows()) add_rows(op, near, E);
  factor_.compute(0.5 * (E + E.transpose()));
  if (factor_.info() != Eigen::Success) patches_.clear(), columns_ = 0;
}

// The same of a body of nodes, whose inverse mass is no matrix.
void Deflation::add_answers(const CoupledOperator& op, std::size_t c, const Near& near, MatX& E) {
  for (const auto& [o, other] : near) {
    const MatX answer = op.respond_alone(c, *other);
    for (const auto& [p, flux] : near)
      E.block(p->first, o->first, p->columns, o->columns).noalias() += flux->transpose() * answer;
  }
}

// What rows take away from Y^T F H^-1 F^T Y: bodies that they tie together answer for each other.
void Deflation::add_rows(const CoupledOperator& op, const std::vector<Near>& near, MatX& E) const {
  for (const Patch& p : patches_) {
    std::vector<MatX> free(op.bodies().size()), force(op.bodies().size());
    for (const int c : op.rows()->bodies())
      free[c] = force[c] = MatX::Zero(op.bodies()[c].rows(), p.columns);
    for (const auto& [c, flux] : p.flux) {
      if (op.bodies()[c].nodes)
        force[c] = flux;  // what it loses follows from the force alone
      else
        free[c] = op.bodies()[c].inverse_mass * flux;
    }
    std::vector<MatX> held = free;
    op.hold(force, held);
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

  /// Adds those of a run's cells; after their numbers 0 follows for a block.
  void add(const Run& run, const float* numbers) {
    if (run.k != plane_) flush(), plane_ = run.k;
    for (int c = 0; c < patch_.columns; ++c) {
      const float* y = patch_.column(run, c);
      Lanes sum = lanes_[c];
      for (int i = 0; i < run.length; i += kLanes) {
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
    if (near) p.flux.emplace_back(c, MatX::Zero(op.bodies()[c].rows(), p.columns));
  }
}

// Columns of E from the water, Y^T (A_water Y) of this patch and those after it, and Fhat^T Y.
void Deflation::add_products(const CoupledOperator& op, Patch& p, MatX& E) const {
  const PoissonMatrix& a = op.water().matrix();
  Spread y(p);
  for (int first = 0; first < p.columns; first += kLanes) {
    const int count = std::min(kLanes, p.columns - first);
    y.load(first, count);
    for (auto& [b, flux] : p.flux) {
      const CoupledOperator::Body& body = op.bodies()[b];
      MatX values = MatX::Zero(count, body.flux.cols());  // of the columns at its flux cells
      for (std::size_t m = 0; m < body.cell.size(); ++m) {
        const Vec3i at = a.cell(body.cell[m]);
        if (!y.reaches(at)) continue;
        const float* value = y.at(at[0], at[1], at[2]);
        for (int c = 0; c < count; ++c) values(c, static_cast<Eigen::Index>(m)) = value[c];
      }
      if (body.nodes)
        flux.middleCols(first, count) += body.gather(values.transpose());
      else
        flux.middleCols(first, count).noalias() += body.flux * values.transpose();
    }
    for (const Patch& other : patches_) {
      const bool apart = ((other.low + other.size).array() <= y.low().array()).any() ||
                         (other.low.array() >= y.high().array()).any();
      if (other.first < p.first || apart) continue;
      E.block(other.first, p.first + first, other.columns, count) =
          products(a, y, other).leftCols(count);
    }
  }
}

// The columns of `other` times A_water y: fp32 in a plane, fp64 over planes.
MatX Deflation::products(const PoissonMatrix& a, const Spread& y, const Patch& other) const {
  const int low = y.low()[2], planes = y.high()[2] - low;
  std::vector<std::vector<Lanes>> in_plane(planes);
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (!many_patches())
  for (int k = 0; k < planes; ++k)
    carrier.run([&] {
      in_plane[k].assign(other.columns, Lanes{});
      add_products_of_plane(a, y, other, low + k, in_plane[k]);
    });
  carrier.rethrow();
  MatX sums = MatX::Zero(other.columns, kLanes);
  for (const std::vector<Lanes>& plane : in_plane)
    for (int c = 0; c < other.columns; ++c)
      for (int l = 0; l < kLanes; ++l) sums(c, l) += plane[c][l];
  return sums;
}

void Deflation::add_products_of_plane(const PoissonMatrix& a, const Spread& y, const Patch& other,
                                      int k, std::vector<Lanes>& sums) {
  AlignedFloats product(static_cast<std::size_t>(other.size[0]) * kLanes);
  for (const Run& run : other.plane(k)) {
    const int begin = std::max(run.i, y.low()[0]),
              n = std::min(run.i + run.length, y.high()[0]) - begin;
    if (run.j < y.low()[1] || run.j >= y.high()[1] || n <= 0) continue;
    y.product(a, begin, run.j, k, n, product.data());
    for (int c = 0; c < other.columns; ++c) {
      const float* own = other.column(run, c) + (begin - run.i);
      Lanes even = sums[c], odd = {}, Ay;
      int i = 0;
      for (; i + 1 < n; i += 2) {
        read_block(product.data() + i * kLanes, Ay);
        even += own[i] * Ay;
        read_block(product.data() + (i + 1) * kLanes, Ay);
        odd += own[i + 1] * Ay;
      }
      if (i < n) read_block(product.data() + i * kLanes, Ay), even += own[i] * Ay;
      sums[c] = even + odd;
    }
  }
}

void Deflation::correct(const PoissonOperator& water, const PaddedLayout& layout, const double* r,
                        double scale, const std::vector<VecX>& response, float* z) {
  constexpr int kPlanes = 8;  // that a thread takes at once
  std::vector<std::pair<const Patch*, int>> piece;
  for (const Patch& p : patches_)
    for (int k = p.low[2]; k < p.low[2] + p.size[2]; k += kPlanes) piece.emplace_back(&p, k);
  std::vector<VecX> sums(piece.size());
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t n = 0; n < piece.size(); ++n)
    carrier.run([&] {
      const auto& [p, k] = piece[n];
      sums[n] = gather(water, layout, *p, k, k + kPlanes, r, scale, z);
    });
  carrier.rethrow();
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

namespace {

// Fetches n numbers into the cache: the rows of a patch are too short for the hardware to see them
// coming.
template <class T>
void fetch(const T* p, int n) {
  constexpr int kLine = 64 / sizeof(T);
  for (int i = 0; i < n; i += kLine) __builtin_prefetch(p + i);
}
// So many runs before they are needed.
constexpr std::size_t kAhead = 4;

}  // namespace

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
      if (const Run* soon = p.after(run, kAhead)) {
        fetch(r + a.kind.index(soon->i, soon->j, soon->k), soon->length);
        fetch(z + layout(soon->i, soon->j + 1, soon->k), soon->length);
        fetch(z + layout(soon->i, soon->j, soon->k + 1), soon->length);
      }
      product_row(water, layout, run.k, run.segment, run.i, run.i + run.length, z, product.data());
      const double* rr = r + a.kind.index(run.i, run.j, run.k);
      for (int i = 0; i < run.length; ++i)
        residual[i] = static_cast<float>(scale * rr[i] - product[i]);
      std::fill_n(residual.begin() + run.length, kLanes, 0.0f);
      dots.add(run, residual.data());
    }
  return dots.sums();
}

// z += the patch's columns, each times its share, in plane k
void Deflation::scatter(const PaddedLayout& layout, const Patch& p, int k, const float* share,
                        float* z) {
  for (const Run& run : p.plane(k)) {
    float* row = z + layout(run.i, run.j, run.k);
    if (const Run* soon = p.after(run, kAhead)) {
      fetch(z + layout(soon->i, soon->j, soon->k), soon->length);
      fetch(p.column(*soon, 0), soon->length * p.columns);
    }
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
