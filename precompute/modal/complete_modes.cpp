#include "precompute/modal/complete_modes.h"

#include <fmt/core.h>
#include <Eigen/Dense>
#include <string>

#include "common/base/input_error.h"
#include "precompute/modal/memory.h"

namespace archetide {
namespace {

void demand_small(Eigen::Index dofs, Eigen::Index modes) {
  const std::string all = fmt::format(
      "{} modes of {} nodes, every degree of freedom (modes.count = \"full\")", modes, dofs / 3);
  if (modes > kMostCompleteModes)
    throw InputError(fmt::format("{}: at most {} modes, {} nodes", all, kMostCompleteModes,
                                 kMostCompleteModes / 3 + 2),
                     "lower tet.target, or set tet.order = 1");
  // six matrices of the eigensolver, and the integrals, once as products and once as they are kept
  const double n = static_cast<double>(dofs), r = static_cast<double>(modes);
  demand_memory(8.0 * (6.0 * n * n + 18.0 * r * r), all, "lower tet.target, or set tet.order = 1");
}

/// M x 1_3, dense.
MatX dense_mass(const SparseMatrix& mass) {
  MatX M = MatX::Zero(3 * mass.rows(), 3 * mass.cols());
  for (int c = 0; c < mass.cols(); ++c)
    for (SparseMatrix::InnerIterator m(mass, c); m; ++m)
      for (int axis = 0; axis < 3; ++axis) M(3 * m.row() + axis, 3 * c + axis) = m.value();
  return M;
}

}  // namespace

EigenResult every_eigenpair(const SparseMatrix& stiffness, const SparseMatrix& mass,
                            const MatX& rigid) {
  const Eigen::Index dofs = stiffness.rows(), modes = dofs - rigid.cols();
  demand_small(dofs, modes);
  const Eigen::LLT<MatX> factor(dense_mass(mass));
  const auto L = factor.matrixL();
  const auto U = factor.matrixU();

  // L⁻¹ K L⁻ᵀ with the rigid motions lifted above all others, so that none of them mixes in
  MatX C = L.solve(MatX(stiffness));
  C = L.solve(MatX(C.transpose()));
  const MatX lifted = U * rigid;
  C += (2.0 * C.norm()) * lifted * lifted.transpose();
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(C);
  if (factor.info() != Eigen::Success || eigen.info() != Eigen::Success)
    throw NumericsError(fmt::format(
        "the dense eigensolver failed on {} degrees of freedom\n  badly shaped tets?", dofs));
  EigenResult result;
  result.values = eigen.eigenvalues().head(modes);
  result.vectors = U.solve(eigen.eigenvectors().leftCols(modes));
  return result;
}

}  // namespace archetide
