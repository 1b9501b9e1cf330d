#include "precompute/modal/momentum_integrals.h"

#include "common/base/check.h"

namespace archetide {

MomentumIntegrals momentum_integrals(const std::vector<Vec3>& nodes, const SparseMatrix& mass,
                                     const MatX& modes) {
  const Eigen::Index n = Eigen::Index(nodes.size()), r = modes.cols();
  ARCHETIDE_CHECK_OP(mass.rows(), ==, n);
  // Rest shape and modes side by side, n x 3(1 + r): column 3 c + axis.
  MatX fields(n, 3 * (1 + r));
  for (Eigen::Index i = 0; i < n; ++i) fields.row(i).head<3>() = nodes[i].transpose();
  for (Eigen::Index c = 0; c < r; ++c)
    for (int axis = 0; axis < 3; ++axis)
      fields.col(3 * (1 + c) + axis) = modes.col(c)(Eigen::seqN(axis, n, 3));

  const MatX weighted = mass * fields;
  const MatX products = fields.transpose() * weighted;  // all sums m f gᵀ at once
  const VecX sums = weighted.colwise().sum();

  MomentumIntegrals integrals;
  integrals.mass = (mass * VecX::Ones(n)).sum();  // mass.sum() rounds by where its values lie
  integrals.Sxx = products.topLeftCorner<3, 3>();
  for (Eigen::Index i = 0; i < r; ++i) {
    integrals.I3.emplace_back(sums.segment<3>(3 * (1 + i)));
    integrals.A.emplace_back(products.block<3, 3>(0, 3 * (1 + i)));
    for (Eigen::Index j = 0; j < r; ++j)
      integrals.B.emplace_back(products.block<3, 3>(3 * (1 + i), 3 * (1 + j)));
  }
  return integrals;
}

}  // namespace archetide
