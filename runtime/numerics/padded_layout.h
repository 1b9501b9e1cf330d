#pragma once

#include <cstddef>

#include "runtime/numerics/lanes.h"

namespace archetide {

/// Room before the first cell of a row of a padded layout: its ghost, and what makes rows begin on
/// a cache line.
inline constexpr int kLead = 16;

/// Entries of such a row of n cells: after the last cell there is room for a block.
inline std::size_t padded_row(int n) {
  return static_cast<std::size_t>((kLead + n + kLanes - 1 + kLanes - 1) / kLanes) * kLanes;
}

/// A box of cells with a layer of ghosts around it: where the fp32 vectors of a solve keep the
/// cells of the grid around the water, so that a row can read all its neighbours.
struct PaddedLayout {
  int low[3] = {0, 0, 0};                // cell of the grid that is cell 0 of the box
  int nx = 0, ny = 0, nz = 0;            // cells of the box
  std::size_t sy = 0, sz = 0, size = 0;  // strides of j and k, entries

  PaddedLayout() = default;
  PaddedLayout(const int first[3], const int cells[3])
      : low{first[0], first[1], first[2]},
        nx(cells[0]),
        ny(cells[1]),
        nz(cells[2]),
        sy(padded_row(nx)),
        sz(sy * (ny + 2)),
        size(sz * (nz + 2)) {}

  /// Place of cell (i, j, k) of the grid.
  std::size_t operator()(int i, int j, int k) const {
    return static_cast<std::size_t>(i - low[0] + kLead) +
           sy * static_cast<std::size_t>(j - low[1] + 1) +
           sz * static_cast<std::size_t>(k - low[2] + 1);
  }
};

}  // namespace archetide
