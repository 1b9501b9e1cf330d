#include "runtime/coupling/deflation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "runtime/numerics/fused_steps.h"
#include "runtime/numerics/multigrid.h"

namespace archetide {
namespace {

// Directions whose added mass is below this part of the body's own cost no iterations worth saving.
constexpr double kKept = 0.5;
// A patch reaches beyond the body by this part of its extent, and at least so many cells. (16
// bodies at 0.3 in 128^3: 12 iterations with 0.12, 11 with 0.2 and 0.25, 10 with 0.3, for 9, 16 and
// 20 % more CPU seconds; with 0.12 the count grew by a third from 64^3.)
constexpr double kMargin = 0.2;
constexpr int kLeastMargin = 3;
// Columns beyond this are not worth their dense E.
constexpr int kMostColumns = 4000;

Vec3i cell_of(const PoissonMatrix& a, std::int64_t n) {
  return {static_cast<int>(n % a.nx), static_cast<int>(n / a.nx % a.ny),
          static_cast<int>(n / a.nx / a.ny)};
}

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
    for (std::int64_t n : body_.cell) place_.push_back(place(cell_of(op.water().matrix(), n)));
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
  VecX added_momentum() {
    const float* z = cycle_.iterate();
    VecX sum = VecX::Zero(body_.flux.rows());
    for (std::size_t m = 0; m < place_.size(); ++m)
      sum.noalias() +=
          static_cast<double>(z[place_[m]]) * body_.flux.col(static_cast<Eigen::Index>(m));
    return sum;
  }
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
  Vec3i low(a.nx, a.ny, a.nz), high = Vec3i::Zero();
  for (std::int64_t n : op.bodies()[b].cell) {
    const Vec3i c = cell_of(a, n);
    low = low.cwiseMin(c), high = high.cwiseMax(c + Vec3i::Ones());
  }
  if (op.bodies()[b].cell.empty()) return p;
  p.extent = (high - low).maxCoeff();
  const int margin = std::max(kLeastMargin, static_cast<int>(kMargin * p.extent));
  p.low = (low.array() - margin).max(0);
  p.size = (high.array() + margin).min(Eigen::Array3i(a.nx, a.ny, a.nz)).matrix() - p.low;
  const Vec3i end = p.low + p.size;
  for (int k = p.low[2]; k < end[2]; ++k) {
    const auto& segments = op.water().rows().plane(k);
    for (std::size_t n = 0; n < segments.size(); ++n) {
      const Segment& s = segments[n];
      const int from = std::max(s.begin, p.low[0]), to = std::min(s.end, end[0]);
      if (s.j < p.low[1] || s.j >= end[1] || from >= to) continue;
      p.runs.push_back({from, s.j, k, to - from, n, p.cells});
      p.cells += to - from;
    }
  }
  return p;
}

// The directions of a body whose added mass counts, as S' = S U with U eigenvectors of S^T F F^T S:
// the flux alone tells the added mass roughly (spheres and blobs of 6 to 60 cells in extent: up to
// a third off what the cycle of the patch finds; the constant is measured).
Deflation::Light Deflation::light_directions(const CoupledOperator& op, const Patch& p) {
  constexpr double kAddedMass = 0.11;
  const CoupledOperator::Body& body = op.bodies()[p.body];
  const int extent = p.extent;
  const MatX S = root(op.own_inverse(p.body)), FS = S.transpose() * body.flux;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(FS * FS.transpose());
  const VecX ratio = kAddedMass * extent * eigen.eigenvalues();
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
#pragma omp parallel for schedule(dynamic)
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
  std::vector<std::vector<float>> Z(dofs, std::vector<float>(p.cells));
  MatX K(dofs, dofs);
  for (Eigen::Index c = 0; c < dofs; ++c) {
    const float* z = local.respond(S.col(c));
    K.col(c) = S.transpose() * local.added_momentum();
    for (const Run& run : p.runs)
      std::copy_n(z + local.place(Vec3i(run.i, run.j, run.k)), run.length, Z[c].data() + run.at);
  }
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(0.5 * (K + K.transpose()));
  p.columns = static_cast<int>((eigen.eigenvalues().array() > kKept).count());
  p.y.assign((p.columns + kBlock - 1) / kBlock, Block(p.cells * kBlock));
  for (int block = 0; block < static_cast<int>(p.y.size()); ++block) {
    std::vector<float> q(dofs * kBlock, 0.0f);  // dofs x kBlock
    for (int c = 0; c < kBlock && block * kBlock + c < p.columns; ++c) {
      const Eigen::Index e = dofs - 1 - block * kBlock - c;
      for (Eigen::Index d = 0; d < dofs; ++d)
        q[d * kBlock + c] = static_cast<float>(eigen.eigenvectors()(d, e) / eigen.eigenvalues()[e]);
    }
    for (std::size_t m = 0; m < p.cells; ++m) {
      float sum[kBlock] = {};
      for (Eigen::Index d = 0; d < dofs; ++d) {
        const float z = Z[d][m], *qd = q.data() + d * kBlock;
#pragma omp simd
        for (int l = 0; l < kBlock; ++l) sum[l] += z * qd[l];
      }
      std::copy_n(sum, kBlock, p.y[block].data() + m * kBlock);
    }
  }
}

// E = Y^T A Y
void Deflation::assemble(const CoupledOperator& op) {
  MatX E = MatX::Zero(columns_, columns_);
  for (Patch& p : patches_)
    for (int block = 0; block < static_cast<int>(p.y.size()); ++block) add_product(op, p, block, E);
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

// Columns of one block of E from the water, Y^T (A_water y), and of Fhat^T y.
void Deflation::add_product(const CoupledOperator& op, Patch& p, int block, MatX& E) const {
  const PoissonMatrix& a = op.water().matrix();
  const int first = p.first + block * kBlock,
            columns = std::min(kBlock, p.columns - block * kBlock);
  // y on the box and one cell around it
  const Vec3i low = p.low - Vec3i::Ones(), size = p.size + Vec3i::Constant(2);
  const std::size_t sy = size[0], sz = sy * size[1];
  const auto place = [&](const Vec3i& c) {
    const Vec3i d = c - low;
    return (d[0] + sy * d[1] + sz * d[2]) * kBlock;
  };
  std::vector<float> y(sz * size[2] * kBlock, 0.0f);
  for (const Run& run : p.runs)
    std::copy_n(p.y[block].data() + run.at * kBlock, run.length * kBlock,
                y.data() + place(Vec3i(run.i, run.j, run.k)));

  std::size_t touched = 0;
  for (std::size_t c = 0; c < op.bodies().size(); ++c) {
    const CoupledOperator::Body& body = op.bodies()[c];
    MatX sum = MatX::Zero(body.flux.rows(), columns);
    bool inside = false;
    for (std::size_t m = 0; m < body.cell.size(); ++m) {
      const Vec3i cell = cell_of(a, body.cell[m]);
      if (((cell - low).array() < 0).any() || ((cell - low - size).array() >= 0).any()) continue;
      const Eigen::Map<const Eigen::RowVectorXf> row(y.data() + place(cell), columns);
      sum.noalias() += body.flux.col(static_cast<Eigen::Index>(m)) * row.cast<double>();
      inside = true;
    }
    if (!inside) continue;
    if (block == 0) p.flux.emplace_back(c, MatX::Zero(body.flux.rows(), p.columns));
    p.flux[touched++].second.middleCols(block * kBlock, columns) = sum;
  }

  for (const Patch& other : patches_) {
    const Vec3i from = other.low.cwiseMax(low), to = (other.low + other.size).cwiseMin(low + size);
    if ((to.array() <= from.array()).any()) continue;
    MatX sums = MatX::Zero(static_cast<Eigen::Index>(other.y.size()) * kBlock, kBlock);
    for (const Run& run : other.runs) {
      const Vec3i start(run.i, run.j, run.k);
      if (start[1] < from[1] || start[1] >= to[1] || start[2] < from[2] || start[2] >= to[2])
        continue;
      const int begin = std::max(start[0], from[0]), end = std::min(start[0] + run.length, to[0]);
      for (std::size_t ob = 0; ob < other.y.size(); ++ob) {
        float row_sum[kBlock][kBlock] = {};
        for (int i = begin; i < end; ++i) {
          const std::size_t n = a.kind.index(i, run.j, run.k);
          const Vec3i c(i, start[1], start[2]);
          float w[kBlock];
          const float* at = y.data() + place(c);
          const auto neighbour = [&](int d, int side) {
            Vec3i face = c, o = c;
            face[d] += side > 0, o[d] += side;
            const bool unknown = a.kind.contains(o[0], o[1], o[2]) &&
                                 ((o - low).array() >= 0).all() &&
                                 ((low + size - o).array() > 0).all();
            return unknown ? a.w[d](face[0], face[1], face[2]) : 0.0;
          };
          const double diag = a.diag[n], xl = neighbour(0, -1), xh = neighbour(0, 1),
                       yl = neighbour(1, -1), yh = neighbour(1, 1), zl = neighbour(2, -1),
                       zh = neighbour(2, 1);
          const std::ptrdiff_t dx = kBlock, dy = kBlock * static_cast<std::ptrdiff_t>(sy),
                               dz = kBlock * static_cast<std::ptrdiff_t>(sz);
          const float* zero = at;
          const float *pxl = xl != 0 ? at - dx : zero, *pxh = xh != 0 ? at + dx : zero,
                      *pyl = yl != 0 ? at - dy : zero, *pyh = yh != 0 ? at + dy : zero,
                      *pzl = zl != 0 ? at - dz : zero, *pzh = zh != 0 ? at + dz : zero;
#pragma omp simd
          for (int l = 0; l < kBlock; ++l)
            w[l] = static_cast<float>(diag * at[l] - (xl * pxl[l] + xh * pxh[l]) -
                                      (yl * pyl[l] + yh * pyh[l]) - (zl * pzl[l] + zh * pzh[l]));
          const float* own = other.y[ob].data() + (run.at + (i - start[0])) * kBlock;
          for (int m = 0; m < kBlock; ++m) {
#pragma omp simd
            for (int l = 0; l < kBlock; ++l) row_sum[m][l] += own[m] * w[l];
          }
        }
        for (int m = 0; m < kBlock; ++m)
          for (int l = 0; l < kBlock; ++l) sums(ob * kBlock + m, l) += row_sum[m][l];
      }
    }
    E.block(other.first, first, other.columns, columns) +=
        sums.topLeftCorner(other.columns, columns);
  }
}

void Deflation::correct(const PoissonOperator& water, const PaddedLayout& layout, const double* r,
                        double scale, const std::vector<VecX>& response, float* z) {
  weight_.setZero(columns_);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t n = 0; n < patches_.size(); ++n) {
    const Patch& p = patches_[n];
    gather(water, layout, p, r, scale, z);
    for (const auto& [c, flux] : p.flux)
      weight_.segment(p.first, p.columns).noalias() -= flux.transpose() * response[c];
  }
  factor_.solveInPlace(weight_);
  for (const Patch& p : patches_) scatter(layout, p, z);  // patches overlap
}

// The patch's entries of Y^T (scale r - A_water z).
void Deflation::gather(const PoissonOperator& water, const PaddedLayout& layout, const Patch& p,
                       const double* r, double scale, const float* z) {
  const PoissonMatrix& a = water.matrix();
  thread_local std::vector<double> product;
  thread_local std::vector<float> t;
  product.resize(a.nx), t.resize(a.nx);
  MatX sums = MatX::Zero(kBlock, static_cast<Eigen::Index>(p.y.size()));
  Eigen::Matrix<float, kBlock, 1> row;
  for (const Run& run : p.runs) {
    product_row(water, layout, run.k, run.segment, run.i, run.i + run.length, z, product.data());
    const double* rr = r + a.kind.index(run.i, run.j, run.k);
    for (int i = 0; i < run.length; ++i) t[i] = static_cast<float>(scale * rr[i] - product[i]);
    const Eigen::Map<const Eigen::VectorXf> values(t.data(), run.length);
    for (std::size_t block = 0; block < p.y.size(); ++block) {
      const BlockMap y(p.y[block].data() + run.at * kBlock, kBlock, run.length);
      row.noalias() = y * values;
      sums.col(static_cast<Eigen::Index>(block)) += row.cast<double>();
    }
  }
  weight_.segment(p.first, p.columns) = sums.reshaped().head(p.columns);
}

// z += the patch's part of Y times the weights
void Deflation::scatter(const PaddedLayout& layout, const Patch& p, float* z) const {
  for (std::size_t block = 0; block < p.y.size(); ++block) {
    const int first = static_cast<int>(block) * kBlock;
    Eigen::Matrix<float, kBlock, 1> weight = Eigen::Matrix<float, kBlock, 1>::Zero();
    const int columns = std::min(kBlock, p.columns - first);
    weight.head(columns) = weight_.segment(p.first + first, columns).cast<float>();
    for (const Run& run : p.runs) {
      const BlockMap y(p.y[block].data() + run.at * kBlock, kBlock, run.length);
      Eigen::Map<Eigen::VectorXf> values(z + layout(run.i, run.j, run.k), run.length);
      values.noalias() += y.transpose() * weight;
    }
  }
}

std::size_t Deflation::bytes() const {
  std::size_t total = sizeof(double) * static_cast<std::size_t>(columns_) * columns_;
  for (const Patch& p : patches_) {
    total += p.runs.capacity() * sizeof(Run);
    for (const Block& b : p.y) total += b.capacity() * sizeof(float);
  }
  return total;
}

}  // namespace archetide
