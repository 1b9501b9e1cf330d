#include "precompute/modal/ordering.h"

#include "precompute/modal/cholmod_view.h"

namespace archetide {
namespace {

/// One entry per pair of nodes that K couples, n x n.
SparseMatrix node_pattern(const SparseMatrix& stiffness) {
  const int n = int(stiffness.rows() / 3);
  SparseMatrix pattern(n, n);
  pattern.reserve(stiffness.nonZeros() / 9);
  for (int j = 0; j < n; ++j) {
    pattern.startVec(j);
    for (SparseMatrix::InnerIterator k(stiffness, 3 * j); k; ++k)
      if (k.row() % 3 == 0) pattern.insertBack(k.row() / 3, j) = 1.0;
  }
  pattern.finalize();
  return pattern;
}

}  // namespace

std::vector<int> nested_dissection(const SparseMatrix& stiffness) {
  const SparseMatrix pattern = node_pattern(stiffness);
  cholmod_sparse view = cholmod_view(pattern);
  CholmodCommon cholmod;
  std::vector<int> nodes(pattern.rows()), dofs;
  const bool good = cholmod_metis(&view, nullptr, 0, 1, nodes.data(), &cholmod.common);
  cholmod.require(good, "ordering the unknowns (METIS)");
  for (int node : nodes)
    for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * node + axis);
  return dofs;
}

SparseMatrix shifted(const SparseMatrix& stiffness, const SparseMatrix& mass, double s) {
  SparseMatrix result = stiffness;
  for (int c = 0; c < int(result.cols()); ++c) {
    SparseMatrix::InnerIterator m(mass, c / 3);
    for (SparseMatrix::InnerIterator k(result, c); k && m; ++k)
      if (k.row() == 3 * m.row() + c % 3) k.valueRef() += s * m.value(), ++m;
  }
  return result;
}

}  // namespace archetide
