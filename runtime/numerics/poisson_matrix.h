#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// What a cell is to the pressure solve.
enum class CellKind : std::uint8_t {
  kOutside,    // no unknown and no value: solid, or not reached by water
  kUnknown,    // water
  kDirichlet,  // air: value prescribed
};

/// The pressure operator of the water alone, G^T w b^-1 G with b = (dual-cell mass) theta, scaled
/// to be dimensionless: a symmetric 7-point matrix on a box of cells (x fastest),
///     (A x)_c = diag_c x_c - sum over faces f between c and an unknown neighbour n of  w_f x_n .
/// diag_c sums w_f over faces to unknowns and w_f / theta_f over faces to Dirichlet cells (theta in
/// (0,1] is the distance to the interface in cells; an open tank side has theta = 1/2). Vectors
/// have one entry per cell of the box; entries of cells without an unknown are 0 and stay 0.
/// Eq. 23, with the pressure at the surface of [GFCK02].
struct PoissonMatrix {
  int nx = 0, ny = 0, nz = 0;
  Array3<CellKind> kind;  // cells
  FaceField<double> w;    // open area fraction of each MAC face, in [0,1]
  Array3<double> diag;    // cells; > 0 on unknowns, 0 elsewhere
  Sides open_side{};      // true: beyond this side of the box lies Dirichlet (air)

  std::size_t size() const { return kind.size(); }
  /// Indices of cell number n.
  Vec3i cell(std::int64_t n) const {
    return {static_cast<int>(n % nx), static_cast<int>(n / nx % ny), static_cast<int>(n / nx / ny)};
  }
  /// y = A x   (reads 4n + x, writes n)
  void apply(const double* x, double* y) const;
  /// The same for cells begin <= i < end of row (j, k). x is read on unknowns only.
  void apply_row(int j, int k, int begin, int end, const double* x, double* y) const;
};

}  // namespace archetide
