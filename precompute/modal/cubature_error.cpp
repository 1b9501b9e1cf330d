#include "precompute/modal/cubature_error.h"

#include <Eigen/Cholesky>

#include "precompute/base/bounding_diagonal.h"
#include "precompute/modal/nonlinear_elasticity.h"
#include "precompute/modal/static_balance.h"

namespace archetide {
namespace {

/// The energy of all tets, with the stiffness of a cubature.
struct AllTets {
  const TetMesh& mesh;
  const MaterialField& material;
  const MatX& basis;
  const ElasticCubature& cubature;

  double energy(const VecX& q) const { return elastic_state(mesh, material, basis * q).energy; }
  VecX force(const VecX& q) const {
    return basis.transpose() * internal_force(mesh, material, basis * q);
  }
  MatX stiffness(const VecX& q) const { return cubature.stiffness(q); }
};

}  // namespace

DeflectionError cubature_error(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const MatX& K_r, const ElasticCubature& V) {
  constexpr double kReach[3] = {0.1, 0.2, 0.3};  // of the diagonal
  constexpr double kAccuracy = 1e-3;
  const double size = bounding_diagonal(mesh.nodes);
  const MatX loads = basis.transpose() * patch_loads(mesh);
  const Eigen::LDLT<MatX> linear(K_r);
  DeflectionError error;
  for (Eigen::Index k = 0; k < loads.cols(); ++k) {
    const VecX first = basis * linear.solve(loads.col(k));
    const VecX load = kReach[k % 3] * size / first.cwiseAbs().maxCoeff() * loads.col(k);
    const VecX q = static_balance(V, load, VecX::Zero(load.size()));
    const VecX all = static_balance(AllTets{mesh, material, basis, V}, load, q, kAccuracy);
    error.add(basis * q, basis * all, loads.cols());
  }
  return error;
}

}  // namespace archetide
