#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Mass and stiffness of a tet mesh of n nodes, sparse: a block for every pair of nodes p >= q of a
/// tet, rows p one after the other, q ascending, the diagonal last. K and M are symmetric; what is
/// above the diagonal is not kept. With these every node can be a degree of freedom at run time.
struct TetMatrices {
  std::vector<int> order;       // n: nodes in an order of elimination that leaves little fill
  std::vector<int> row_ends;    // n: blocks up to the end of each row
  std::vector<int> column;      // blocks: q
  std::vector<double> mass;     // blocks: M_pq, the same on each axis, kg
  std::vector<Mat3> stiffness;  // blocks: K_pq, N/m
  VecX lambda, mu;              // nt, Pa: Lame's constants of each tet; nonlinear bodies only

  bool empty() const { return order.empty(); }
  int row_begin(int p) const { return p == 0 ? 0 : row_ends[static_cast<std::size_t>(p) - 1]; }
  int row_end(int p) const { return row_ends[static_cast<std::size_t>(p)]; }
};

}  // namespace archetide
