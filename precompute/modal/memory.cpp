#include "precompute/modal/memory.h"

#include <algorithm>
#include <cmath>

namespace archetide {

double least_memory(double tets, int order, int modes) {
  const double nodes = order == 1 ? tets / 5.2 : 1.4 * tets;  // of compact meshes
  const double dofs = 3 * nodes;
  const double neighbours = order == 1 ? 14 : 28;               // of a node, and itself
  const double matrices = 2 * dofs * 3 * neighbours * (8 + 4);  // K and M: value and row
  const double vectors = 8 * dofs * (3.0 * modes + 20);         // ARPACK's basis, the modes
  // Nested dissection of a plate, nnz(L) >= 31/4 n log2 n with n nodes of 3 x 3 blocks, one layer.
  const double factor = 8 * 9 * 7.75 * nodes * std::log2(std::max(2.0, nodes)) / 2;
  return 1000 * tets + matrices + vectors + factor;
}

}  // namespace archetide
