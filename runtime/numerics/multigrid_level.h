#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/numerics/poisson_operator.h"
#include "runtime/numerics/row_segments.h"

namespace archetide {

enum class Colour : int { kRed = 0, kBlack = 1 };  // parity of i + j + k

/// One level of the multigrid: fp32 arrays on a box of cells with one ghost layer, and the row
/// operations of the cycle. x is 0 on every cell that is no unknown; coefficients are 0 on faces
/// that carry nothing.
struct MultigridLevel {
  int nx = 0, ny = 0, nz = 0;  // cells
  std::size_t sy = 0, sz = 0;  // strides of j and k in the padded arrays
  float c = 1.0f;              // coefficient of every face of a uniform segment
  bool parallel = false;       // enough unknowns for threads
  std::size_t unknowns = 0;
  Sides open_side{};  // beyond the box lies Dirichlet
  RowSegments rows;
  std::vector<std::uint8_t> kind;  // padded, CellKind, ghosts included
  std::vector<float> x, b;         // padded, iterate and right-hand side
  std::vector<float> diag,
      inverse;                    // padded, diagonal and 1 / diagonal (0 where the diagonal is 0)
  std::vector<float> wx, wy, wz;  // padded, coefficient of the low face of each cell

  std::size_t index(int i, int j, int k) const {
    return (i + 1) + sy * (j + 1) + sz * static_cast<std::size_t>(k + 1);
  }
  std::size_t bytes() const;

  /// The level of `op`'s cells in a box around the unknowns; `low` receives the box's first cell.
  void load(const PoissonOperator& op, int low[3]);
  /// The 2x2x2 aggregation of `fine`.
  void coarsen(const MultigridLevel& fine);

  /// Gauss-Seidel on the cells of one colour in plane k.
  void relax(int k, Colour colour);
  /// x = diag^-1 b on red, 0 on black, in plane k: the first red relaxation from x = 0.
  void start(int k);
  /// Adds the residual b - A x of plane k to the right-hand side of `coarse` (set to 0 by even k
  /// first).
  void restrict_residual(int k, MultigridLevel& coarse) const;
  /// x += the coarse value, on red cells of plane k (black ones are overwritten by the relaxation
  /// that follows).
  void prolong(int k, const MultigridLevel& coarse);
  /// Sum of b x over plane k.
  double work(int k) const;

 private:
  void resize(int nx_new, int ny_new, int nz_new);
  void set_ghost_kinds();
  void load_kinds(const PoissonMatrix& a, const int low[3]);
  void load_plane(const PoissonOperator& op, const int low[3], int k);
  void coarsen_kinds(const MultigridLevel& fine, int K);
  void coarsen_plane(const MultigridLevel& fine, int K);
  void sum_diagonal_row(int j, int k);
  void add_surface(const MultigridLevel& fine, int k);
  void find_row_segments(int j, int k);
  void count_unknowns();
};

}  // namespace archetide
