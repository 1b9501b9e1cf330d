#include "precompute/modal/keep_matrices.h"

#include "precompute/modal/nonlinear_elasticity.h"
#include "precompute/modal/ordering.h"

namespace archetide {
namespace {

/// Rows 3 p to 3 p + 2 of column block q, which K stores together.
Mat3 block_of(const SparseMatrix& K, int p, int q) {
  Mat3 block;
  for (int axis = 0; axis < 3; ++axis)
    for (int row = 0; row < 3; ++row) block(row, axis) = K.coeff(3 * p + row, 3 * q + axis);
  return block;
}

}  // namespace

TetMatrices keep_matrices(const TetMesh& mesh, const MaterialField& material, MassKind mass,
                          bool nonlinear) {
  const SparseMatrix K = stiffness_matrix(mesh, material), M = mass_matrix(mesh, material, mass);
  TetMatrices out;
  const std::vector<int> dofs = nested_dissection(K);
  for (std::size_t d = 0; d < dofs.size(); d += 3) out.order.push_back(dofs[d] / 3);
  const auto n = static_cast<int>(mesh.nodes.size());
  for (int p = 0; p < n; ++p) {
    // K is symmetric: row p of its blocks is column p
    for (SparseMatrix::InnerIterator k(K, 3 * p); k && k.row() <= 3 * p; ++k) {
      if (k.row() % 3 != 0) continue;
      const int q = static_cast<int>(k.row()) / 3;
      out.column.push_back(q);
      out.mass.push_back(M.coeff(p, q));
      out.stiffness.push_back(block_of(K, p, q));
    }
    out.row_ends.push_back(static_cast<int>(out.column.size()));
  }
  if (nonlinear) {
    LameField lame = lame_of_tets(material, mesh.tets.size());
    out.lambda = std::move(lame.lambda), out.mu = std::move(lame.mu);
  }
  return out;
}

}  // namespace archetide
