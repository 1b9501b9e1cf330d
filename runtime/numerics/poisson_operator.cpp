#include "runtime/numerics/poisson_operator.h"

#include <algorithm>
#include <vector>

#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// Classifies the cells of row (j, k). `none` is a row of cells that are no unknowns.
void classify_row(const PoissonMatrix& a, int j, int k, const CellKind* none, RowCell* cells) {
  const std::size_t row = a.kind.index(0, j, k), sy = a.nx, sz = sy * a.ny;
  const CellKind* kind = a.kind.data() + row;
  const CellKind *south = j > 0 ? kind - sy : none, *north = j + 1 < a.ny ? kind + sy : none;
  const CellKind *down = k > 0 ? kind - sz : none, *up = k + 1 < a.nz ? kind + sz : none;
  const double *d = a.diag.data() + row, *wx = &a.w[0](0, j, k);
  const double *wy = &a.w[1](0, j, k), *wy_up = &a.w[1](0, j + 1, k);
  const double *wz = &a.w[2](0, j, k), *wz_up = &a.w[2](0, j, k + 1);
  const auto water = [](CellKind c) { return c == CellKind::kUnknown; };
  const auto classify = [&](int i, CellKind west, CellKind east) {
    const auto fits = [&](CellKind c, double w) { return !water(c) | (w == 1.0); };
    const int count = water(west) + water(east) + water(south[i]) + water(north[i]) +
                      water(down[i]) + water(up[i]);
    const bool uniform = fits(west, wx[i]) & fits(east, wx[i + 1]) & fits(south[i], wy[i]) &
                         fits(north[i], wy_up[i]) & fits(down[i], wz[i]) & fits(up[i], wz_up[i]) &
                         (d[i] == count) & (count > 0);
    const int cell = uniform ? count : int(kGeneral);
    return static_cast<RowCell>(water(kind[i]) ? cell : int(kNoUnknown));
  };
  cells[0] = classify(0, *none, a.nx > 1 ? kind[1] : *none);
#pragma omp simd
  for (int i = 1; i < a.nx - 1; ++i) cells[i] = classify(i, kind[i - 1], kind[i + 1]);
  if (a.nx > 1) cells[a.nx - 1] = classify(a.nx - 1, kind[a.nx - 2], *none);
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
    if (!s.uniform()) size += 7 * static_cast<std::size_t>(s.end - s.begin);
  }
  out.coefficient.resize(size);
  for (std::size_t m = 0; m < out.first.size(); ++m) {
    const Segment& s = rows_.plane(k)[m];
    if (s.uniform()) continue;
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
    const std::vector<CellKind> none(a.nx, CellKind::kOutside);
    const CellKind* kind = a.kind.data() + a.kind.index(0, 0, k);
    for (int j = 0; j < a.ny; ++j, kind += a.nx) {
      if (std::find(kind, kind + a.nx, CellKind::kUnknown) == kind + a.nx) continue;
      classify_row(a, j, k, none.data(), cells.data());
      rows_.add_row(k, j, cells.data(), a.nx);
    }
    pack_coefficients(k);
  });

  // Per plane the vectors matter from the first to the last unknown.
  blocks_.clear();
  unknowns_ = rows_.unknowns();
  for (int k = 0; k < a.nz; ++k) {
    const auto& plane = rows_.plane(k);
    if (!plane.empty())
      blocks_.add(a.kind.index(plane.front().begin, plane.front().j, k),
                  a.kind.index(plane.back().end - 1, plane.back().j, k) + 1);
  }
}

void PoissonOperator::apply_segment(const Segment& s, int k, const double* x, double* y) const {
  const PoissonMatrix& a = *matrix_;
  if (s.inner != 6) return a.apply_row(s.j, k, s.begin, s.end, x, y);
  const std::size_t sy = a.nx, sz = sy * a.ny;
  const int begin = s.begin + (s.first != 6), end = s.end - (s.last != 6);
  const std::size_t row = a.kind.index(0, s.j, k);
  apply_uniform(x + row + begin, y + row + begin, end - begin, sy, sz);
  const auto apply_end = [&](int i, int neighbours) {
    const std::size_t n = row + i;
    double sum = 0.0;
    const auto add = [&](bool inside, std::size_t m) {
      if (inside && a.kind[m] == CellKind::kUnknown) sum += x[m];
    };
    add(i > 0, n - 1), add(i + 1 < a.nx, n + 1), add(s.j > 0, n - sy), add(s.j + 1 < a.ny, n + sy);
    add(k > 0, n - sz), add(k + 1 < a.nz, n + sz);
    y[n] = neighbours * x[n] - sum;
  };
  if (begin > s.begin) apply_end(s.begin, s.first);
  if (end < s.end) apply_end(s.end - 1, s.last);
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
