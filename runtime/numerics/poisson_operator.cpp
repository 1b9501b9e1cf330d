#include "runtime/numerics/poisson_operator.h"

#include <algorithm>
#include <vector>

#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// Classifies the cells of row (j, k).
void classify_row(const PoissonMatrix& a, int j, int k, RowCell* cells) {
  const std::size_t row = a.kind.index(0, j, k), sy = a.nx, sz = sy * a.ny;
  const CellKind* kind = a.kind.data() + row;
  for (int i = 0; i < a.nx; ++i)
    cells[i] = kind[i] == CellKind::kUnknown ? RowCell::kGeneral : RowCell::kNone;
  if (j == 0 || k == 0 || j + 1 == a.ny || k + 1 == a.nz) return;

  const double *d = a.diag.data() + row, *wx = &a.w[0](0, j, k);
  const double *wy = &a.w[1](0, j, k), *wy_up = &a.w[1](0, j + 1, k);
  const double *wz = &a.w[2](0, j, k), *wz_up = &a.w[2](0, j, k + 1);
  const CellKind *south = kind - sy, *north = kind + sy, *down = kind - sz, *up = kind + sz;
  const auto water = [](CellKind c) { return c == CellKind::kUnknown; };
#pragma omp simd
  for (int i = 1; i < a.nx - 1; ++i) {
    const bool unknowns = water(kind[i]) & water(kind[i - 1]) & water(kind[i + 1]) &
                          water(south[i]) & water(north[i]) & water(down[i]) & water(up[i]);
    const bool open = (wx[i] == 1.0) & (wx[i + 1] == 1.0) & (wy[i] == 1.0) & (wy_up[i] == 1.0) &
                      (wz[i] == 1.0) & (wz_up[i] == 1.0) & (d[i] == 6.0);
    cells[i] = unknowns & open ? RowCell::kUniform : cells[i];
  }
}

// Interior cells: y = 6 x - sum of the six neighbours.
void apply_uniform(const double* x, double* y, std::size_t n, std::size_t sy, std::size_t sz) {
  const double *south = x - sy, *north = x + sy, *down = x - sz, *up = x + sz;
  const double *west = x - 1, *east = x + 1;
#pragma omp simd
  for (std::size_t i = 0; i < n; ++i)
    y[i] = 6.0 * x[i] - ((west[i] + east[i]) + (south[i] + north[i]) + (down[i] + up[i]));
}

// to[i] = w[i] where the neighbour is an unknown, else 0
void pack(const double* w, const CellKind* neighbour, int n, double* to) {
#pragma omp simd
  for (int i = 0; i < n; ++i) to[i] = neighbour[i] == CellKind::kUnknown ? w[i] : 0.0;
}

}  // namespace

void PoissonOperator::pack_coefficients(int k) {
  const PoissonMatrix& a = *matrix_;
  PlaneCoefficients& out = planes_[k];
  out.first.clear();
  std::size_t size = 0;
  for (const Segment& s : rows_.plane(k)) {
    out.first.push_back(size);
    if (!s.uniform) size += 7 * static_cast<std::size_t>(s.end - s.begin);
  }
  out.coefficient.resize(size);
  for (std::size_t m = 0; m < out.first.size(); ++m) {
    const Segment& s = rows_.plane(k)[m];
    if (s.uniform) continue;
    const int i = s.begin, j = s.j, n = s.end - s.begin;
    double* c = out.coefficient.data() + out.first[m];
    std::copy_n(&a.diag(i, j, k), n, c);
    std::fill(c + n, c + 7 * static_cast<std::size_t>(n), 0.0);
    const CellKind* kind = &a.kind(i, j, k);
    const int west = i == 0, east = s.end == a.nx;  // no neighbour beyond the box
    pack(&a.w[0](i, j, k) + west, kind - 1 + west, n - west, c + n + west);
    pack(&a.w[0](i, j, k) + 1, kind + 1, n - east, c + 2 * n);
    if (j > 0) pack(&a.w[1](i, j, k), &a.kind(i, j - 1, k), n, c + 3 * n);
    if (j + 1 < a.ny) pack(&a.w[1](i, j + 1, k), &a.kind(i, j + 1, k), n, c + 4 * n);
    if (k > 0) pack(&a.w[2](i, j, k), &a.kind(i, j, k - 1), n, c + 5 * n);
    if (k + 1 < a.nz) pack(&a.w[2](i, j, k + 1), &a.kind(i, j, k + 1), n, c + 6 * n);
  }
}

void PoissonOperator::setup(const PoissonMatrix& matrix) {
  matrix_ = &matrix;
  const PoissonMatrix& a = matrix;
  rows_.reset(a.nz);
  planes_.resize(a.nz);
  for_each_index(a.nz, a.size() >= kParallelCells, [&](int k) {
    std::vector<RowCell> cells(a.nx);
    const CellKind* kind = a.kind.data() + a.kind.index(0, 0, k);
    for (int j = 0; j < a.ny; ++j, kind += a.nx) {
      if (std::find(kind, kind + a.nx, CellKind::kUnknown) == kind + a.nx) continue;
      classify_row(a, j, k, cells.data());
      rows_.add_row(k, j, cells.data(), a.nx);
    }
    pack_coefficients(k);
  });

  // Per plane the vectors matter from the first to the last unknown.
  blocks_.clear();
  unknowns_ = 0;
  for (int k = 0; k < a.nz; ++k) {
    const auto& plane = rows_.plane(k);
    for (const Segment& s : plane) unknowns_ += s.end - s.begin;
    if (!plane.empty())
      blocks_.add(a.kind.index(plane.front().begin, plane.front().j, k),
                  a.kind.index(plane.back().end - 1, plane.back().j, k) + 1);
  }
}

void PoissonOperator::apply_segment(const Segment& s, int k, const double* x, double* y) const {
  const PoissonMatrix& a = *matrix_;
  const std::size_t sy = a.nx, sz = sy * a.ny, begin = a.kind.index(s.begin, s.j, k);
  if (s.uniform)
    apply_uniform(x + begin, y + begin, s.end - s.begin, sy, sz);
  else
    a.apply_row(s.j, k, s.begin, s.end, x, y);
}

void PoissonOperator::apply(const double* x, double* y) const {
  const PoissonMatrix& a = *matrix_;
  for_each_index(rows_.planes(), unknowns_ >= kParallelCells, [&](int k) {
    const auto& plane = rows_.plane(k);
    if (plane.empty()) return;
    std::size_t done = a.kind.index(plane.front().begin, plane.front().j, k);
    for (const Segment& s : plane) {
      const std::size_t begin = a.kind.index(s.begin, s.j, k), n = s.end - s.begin;
      std::fill(y + done, y + begin, 0.0);  // cells without an unknown
      apply_segment(s, k, x, y);
      done = begin + n;
    }
  });
}

}  // namespace archetide
