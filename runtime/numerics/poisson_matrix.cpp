#include "runtime/numerics/poisson_matrix.h"

#include <algorithm>

namespace archetide {
namespace {

// w x where the neighbour is an unknown, else 0 (x may hold anything there).
inline double flow(double w, CellKind kind, double x) {
  return kind == CellKind::kUnknown ? w * x : 0.0;
}

}  // namespace

void PoissonMatrix::apply_row(int j, int k, int begin, int end, const double* x, double* y) const {
  const std::size_t row = kind.index(0, j, k), stride_y = nx, stride_z = stride_y * ny;
  const CellKind* cell = kind.data() + row;
  const double *d = diag.data() + row, *xr = x + row;
  double* yr = y + row;

  // y and z neighbours; a face on the side of the box has no unknown beyond it.
  struct Neighbour {
    bool inside;
    const double* w;
    std::ptrdiff_t to;
  };
  const std::ptrdiff_t sy = static_cast<std::ptrdiff_t>(stride_y),
                       sz = static_cast<std::ptrdiff_t>(stride_z);
  const Neighbour sides[4] = {{j > 0, &w[1](0, j, k), -sy},
                              {j + 1 < ny, &w[1](0, j + 1, k), sy},
                              {k > 0, &w[2](0, j, k), -sz},
                              {k + 1 < nz, &w[2](0, j, k + 1), sz}};
#pragma omp simd
  for (int i = begin; i < end; ++i) yr[i] = cell[i] == CellKind::kUnknown ? d[i] * xr[i] : 0.0;
  for (const Neighbour& side : sides) {
    if (!side.inside) continue;
    const double *wf = side.w, *xn = xr + side.to;
    const CellKind* neighbour = cell + side.to;
#pragma omp simd
    for (int i = begin; i < end; ++i)
      yr[i] -= cell[i] == CellKind::kUnknown ? flow(wf[i], neighbour[i], xn[i]) : 0.0;
  }

  // x neighbours
  const double* wx = &w[0](0, j, k);
  const int low = std::max(begin, 1), high = std::min(end, nx - 1);
#pragma omp simd
  for (int i = low; i < end; ++i)
    yr[i] -= cell[i] == CellKind::kUnknown ? flow(wx[i], cell[i - 1], xr[i - 1]) : 0.0;
#pragma omp simd
  for (int i = begin; i < high; ++i)
    yr[i] -= cell[i] == CellKind::kUnknown ? flow(wx[i + 1], cell[i + 1], xr[i + 1]) : 0.0;
}

void PoissonMatrix::apply(const double* x, double* y) const {
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) apply_row(j, k, 0, nx, x, y);
}

}  // namespace archetide
