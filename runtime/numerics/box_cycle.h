#pragma once

#include <cstddef>
#include <vector>

#include "runtime/numerics/aligned.h"
#include "runtime/numerics/lanes.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/multigrid_level.h"

namespace archetide {

/// The part of a MultigridLevel in a box, with zero beyond it, for kLanes right-hand sides at once:
/// the same operations on a block of kLanes numbers in each cell. A coefficient serves all of them,
/// and short rows waste nothing, so many cycles of small boxes are several times cheaper.
struct BlockLevel {
  using Rows = MultigridLevel::Rows;  // with k and j from the box's corner on

  int low[3] = {0, 0, 0};      // where storage begins, in cells of the level; even, as a cell and
                               // its neighbour have one parent
  int nx = 0, ny = 0, nz = 0;  // cells from there on
  bool parallel = false;
  AlignedFloats x, b;  // kLanes a cell of the box with one ghost layer; x 0 off the unknowns

  /// The cells begin <= c < end of the level.
  void load(const MultigridLevel& level, const int begin[3], const int end[3]);
  /// Number of the block of cell (i, j, k) of the level.
  std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i - low[0] + 1) +
           sy_ * static_cast<std::size_t>(j - low[1] + 1) +
           sz_ * static_cast<std::size_t>(k - low[2] + 1);
  }
  int strip(int stages) const;
  std::size_t work_of(int k) const;

  void relax(const Rows& r, Colour colour, MultigridLevel::Prefetch);
  void start(const Rows& r);
  void clear_rhs();
  void restrict_residual(const Rows& r, BlockLevel& coarse) const;
  void prolong(const Rows& r, const BlockLevel& coarse);

 private:
  // Of a cell: 1 / diagonal (0 where the diagonal is 0), the faces at -x, +x, -y, +y, -z, +z, and
  // the diagonal.
  static constexpr int kCoefficients = 8;
  struct Stretch {
    int j, begin, end;  // unknowns of a row, in cells of the level
  };
  template <class F>
  void for_cells(const Rows& r, F&& f) const;
  template <class F>
  void for_coloured(const Rows& r, Colour colour, F&& f) const;
  void neighbours(std::size_t cell, Lanes& sum) const;
  void load_plane(const MultigridLevel& level, const int begin[3], const int end[3], int plane);

  std::size_t sy_ = 0, sz_ = 0;                // strides of j and k, blocks
  AlignedFloats coefficient_;                  // kCoefficients a block
  std::vector<std::vector<Stretch>> stretch_;  // of each plane of the box
};

/// A V-cycle for kLanes right-hand sides on a box of the cells of a Multigrid, with zero beyond it,
/// from the coefficients of that one's levels: what a pressure solve near a body is worth as a
/// direction to deflate. Storage is kept from one box to the next.
class BoxCycle {
 public:
  /// The box of cells [low, low + size) of the Multigrid's matrix; right-hand sides become 0.
  void setup(const Multigrid& whole, const int low[3], const int size[3]);

  /// Number n of cell (i, j, k) of the matrix stands at place(i, j, k) + n of rhs() and iterate().
  std::size_t place(int i, int j, int k) const;
  float* rhs() { return levels_[0].b.data(); }
  /// 0 off the unknowns.
  const float* iterate() const { return levels_[0].x.data(); }
  /// iterate() = V rhs()
  void cycle();

 private:
  void cycle(int l);

  std::vector<BlockLevel> levels_;  // more than `used_` only from earlier boxes
  int used_ = 0;
  int offset_[3] = {0, 0, 0};  // cell of the matrix that is cell 0 of the finest level
};

}  // namespace archetide
