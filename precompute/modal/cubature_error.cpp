#include "precompute/modal/cubature_error.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <random>

#include "precompute/modal/boundary_quadrature.h"
#include "precompute/modal/nonlinear_elasticity.h"
#include "precompute/modal/static_balance.h"

namespace archetide {
namespace {

/// The generalised force (r) of a uniform traction (Pa) on the boundary within `radius` of `centre`.
VecX patch_load(const std::vector<BoundaryPoint>& boundary, const MatX& basis, const Vec3& centre,
                double radius, const Vec3& traction) {
  VecX load = VecX::Zero(basis.cols());
  for (const BoundaryPoint& p : boundary) {
    if ((p.position - centre).norm() > radius) continue;
    for (int i = 0; i < p.count; ++i)
      load += p.N[i] * p.area.norm() * basis.middleRows<3>(3 * p.nodes[i]).transpose() * traction;
  }
  return load;
}

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

DeflectionError deflection_error(const TetMesh& mesh, const MaterialField& material,
                                 const MatX& basis, const MatX& K_r, const ElasticCubature& V) {
  constexpr int kLoads = 12;
  constexpr double kRadius[2] = {0.12, 0.25}, kReach[3] = {0.1, 0.2, 0.3};  // of the diagonal
  constexpr double kAccuracy = 1e-3;
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.nodes) box.extend(x);
  const double size = box.diagonal().norm();
  const std::vector<BoundaryPoint> boundary = boundary_points(mesh);
  const Eigen::LDLT<MatX> linear(K_r);
  std::mt19937 random(20260102);
  std::normal_distribution<double> normal;
  DeflectionError result;
  for (int k = 0; k < kLoads; ++k) {
    const Vec3 centre = boundary[random() % boundary.size()].position;
    const Vec3 traction{normal(random), normal(random), normal(random)};
    VecX load = patch_load(boundary, basis, centre, kRadius[k % 2] * size, traction);
    load *= kReach[k % 3] * size / (basis * linear.solve(load)).cwiseAbs().maxCoeff();
    const VecX q = static_balance(V, load, VecX::Zero(load.size()));
    const VecX all = basis * static_balance(AllTets{mesh, material, basis, V}, load, q, kAccuracy);
    const double error = (basis * q - all).cwiseAbs().maxCoeff() / all.cwiseAbs().maxCoeff();
    result.mean += error / kLoads;
    result.worst = std::max(result.worst, error);
  }
  return result;
}

}  // namespace archetide
