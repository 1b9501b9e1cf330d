#pragma once

#include <cstddef>

namespace archetide {

/// Room before the first cell of a row of a padded layout: its ghost, and what makes rows begin on
/// a cache line.
inline constexpr int kLead = 16;

/// A box of cells with a layer of ghosts around it: where the fp32 vectors of a solve keep the
/// cells of the grid around the water, so that a row can read all its neighbours.
struct PaddedLayout {
  int low[3] = {0, 0, 0};                // cell of the grid that is cell 0 of the box
  int nx = 0, ny = 0, nz = 0;            // cells of the box
  std::size_t sy = 0, sz = 0, size = 0;  // strides of j and k, entries

  /// Place of cell (i, j, k) of the grid.
  std::size_t operator()(int i, int j, int k) const {
    return static_cast<std::size_t>(i - low[0] + kLead) +
           sy * static_cast<std::size_t>(j - low[1] + 1) +
           sz * static_cast<std::size_t>(k - low[2] + 1);
  }
};

}  // namespace archetide
