#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/numerics/aligned.h"
#include "runtime/numerics/padded_layout.h"
#include "runtime/numerics/parallel.h"
#include "runtime/numerics/poisson_operator.h"
#include "runtime/numerics/row_segments.h"

namespace archetide {

enum class Colour : int { kRed = 0, kBlack = 1 };  // parity of i + j + k

/// What a cell's right-hand side is multiplied by; a diagonal smaller than this has no face worth
/// the name: the cell is left alone. One below some units of round-off of single precision is taken
/// for these: a body that moves in a cell so nearly closed would be answered beyond what the cycle
/// tells of its neighbours [D85].
inline float inverse_of(float diagonal) {
  constexpr float kSmallestDiagonal = 1e-30f;
  constexpr float kFewUnits = 5e-7f;
  return diagonal > kSmallestDiagonal ? 1.0f / std::max(diagonal, kFewUnits) : 0.0f;
}

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
  AlignedFloats x, b;              // padded, iterate and right-hand side
  // The coefficients: of the finest level those of the matrix, else padded arrays.
  const PoissonMatrix* matrix = nullptr;
  int low[3] = {0, 0, 0};    // cell of the matrix that is cell 0
  AlignedFloats diag;        // padded
  AlignedFloats wx, wy, wz;  // padded, coefficient of the low face of each cell
  // The same for the cycle, only where it is not uniform: per plane, its segments one after the
  // other. A segment of n cells has n entries each of 1 / diagonal (0 where the diagonal is 0), the
  // faces at -x, +x, -y, +y, -z, +z, and the diagonal. (Read from the padded arrays the single
  // cells beside the walls of every row cost as much as all others: a cache line for each number.)
  struct PlaneCoefficients {
    std::vector<float> value;
    std::vector<std::size_t> first;  // of each segment
  };
  std::vector<PlaneCoefficients> planes;

  std::size_t index(int i, int j, int k) const {
    return (kLead + i) + sy * (j + 1) + sz * static_cast<std::size_t>(k + 1);
  }
  std::size_t bytes() const;

  /// The level of `op`'s cells in a box around the unknowns.
  void load(const PoissonOperator& op);
  /// The 2x2x2 aggregation of `fine`.
  void coarsen(const MultigridLevel& fine);

  /// Coefficients of the low faces of cells (i .. i + n - 1, j, k) along an axis, in place or in
  /// `scratch` (n).
  const float* faces(int axis, int i, int j, int k, int n, float* scratch) const;
  const float* diagonal(int i, int j, int k, int n, float* scratch) const;

  /// Rows first <= j < end of plane k.
  struct Rows {
    int k, first, end;
  };
  Rows plane(int k) const { return {k, 0, ny}; }
  std::size_t work_of(int k) const { return rows.work(k); }
  /// Rows of a strip that stays in cache over the stages of a way down or up.
  int strip(int stages) const { return strip_rows(stages, 2 * sizeof(float) * sy); }

  /// What to fetch into the cache meanwhile: x, or b, so many planes further on.
  struct Prefetch {
    bool rhs = false;
    int planes = 0;
  };
  /// Gauss-Seidel on the cells of one colour.
  void relax(const Rows& r, Colour colour, Prefetch prefetch);
  /// x = diag^-1 b on red, 0 on black: the first red relaxation from x = 0.
  void start(const Rows& r);
  /// Sets plane k of b to 0.
  void clear_rhs(int k);
  /// Adds the residual b - A x to the right-hand side of `coarse`.
  void restrict_residual(const Rows& r, MultigridLevel& coarse) const;
  /// x += the coarse value, on red cells (black ones are overwritten by the relaxation that
  /// follows).
  void prolong(const Rows& r, const MultigridLevel& coarse);
  /// Sum of b x.
  double work(const Rows& r) const;

 private:
  void resize(int nx_new, int ny_new, int nz_new);
  void set_ghost_kinds();
  void load_kinds();
  void load_rows(const PoissonOperator& op, int k);
  void coarsen_kinds(const MultigridLevel& fine, int K);
  std::pair<int, int> uniform_parents(int J, int K) const;
  void coarsen_plane(const MultigridLevel& fine, int K);
  void sum_diagonal_row(int j, int k);
  void add_surface(const MultigridLevel& fine, int k);
  void find_row_segments(int j, int k);
  void pack_coefficients(int k);
  void count_unknowns();
};

}  // namespace archetide
