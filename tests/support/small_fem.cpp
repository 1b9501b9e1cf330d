#include "tests/support/small_fem.h"

#include <Eigen/Dense>

namespace archetide {
namespace {

/// V B^T E B with the strains of the six Voigt components in rows, [Zienkiewicz, Taylor].
Eigen::Matrix<double, 12, 12> tet_stiffness(const TetMesh& mesh, int t,
                                            const Eigen::Matrix<double, 6, 6>& E) {
  Eigen::Matrix4d corners;  // rows (1, x): the inverse's columns are the shape functions
  for (int a = 0; a < 4; ++a) corners.row(a) << 1.0, mesh.nodes[mesh.tets[t][a]].transpose();
  const Eigen::Matrix4d shape = corners.inverse();
  Eigen::Matrix<double, 6, 12> B = Eigen::Matrix<double, 6, 12>::Zero();
  for (int a = 0; a < 4; ++a) {
    const Vec3 d = shape.block<3, 1>(1, a);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      B(i, 3 * a + i) = d[i];
      B(3 + i, 3 * a + i) = d[j], B(3 + i, 3 * a + j) = d[i];  // engineering shear i, j
    }
  }
  return tet_volume(mesh, t) * B.transpose() * E * B;
}

Eigen::Matrix<double, 6, 6> isotropic(double young, double poisson) {
  const double lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
  const double mu = young / (2.0 * (1.0 + poisson));
  Eigen::Matrix<double, 6, 6> E = Eigen::Matrix<double, 6, 6>::Zero();
  E.topLeftCorner<3, 3>().setConstant(lambda);
  E.diagonal() << Vec3::Constant(lambda + 2.0 * mu), Vec3::Constant(mu);
  return E;
}

}  // namespace

MatX SmallFem::mass() const {
  const Eigen::Index n = scalar_mass.rows();
  MatX M = MatX::Zero(3 * n, 3 * n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b)
      M.block<3, 3>(3 * a, 3 * b) = scalar_mass(a, b) * Mat3::Identity();
  return M;
}

SmallFem small_fem(const TetMesh& mesh, double density, double young, double poisson) {
  const auto n = static_cast<Eigen::Index>(mesh.nodes.size());
  SmallFem fem{MatX::Zero(3 * n, 3 * n), MatX::Zero(n, n)};
  const auto E = isotropic(young, poisson);
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) {
    const auto k = tet_stiffness(mesh, t, E);
    const auto& c = mesh.tets[t];
    const double m = density * tet_volume(mesh, t) / 20.0;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        fem.K.block<3, 3>(3 * c[a], 3 * c[b]) += k.block<3, 3>(3 * a, 3 * b);
        fem.scalar_mass(c[a], c[b]) += m * (a == b ? 2.0 : 1.0);
      }
  }
  return fem;
}

ElasticModes elastic_modes(const SmallFem& fem) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(fem.K, fem.mass());
  const Eigen::Index r = fem.K.rows() - 6;
  return {eigen.eigenvectors().rightCols(r), eigen.eigenvalues().tail(r).cwiseSqrt()};
}

NodalStepper::NodalStepper(const SmallFem& fem, double dt)
    : mass_(fem.mass()),
      implicit_((0.5 * dt * fem.beta + 0.25 * dt * dt) * fem.K),
      K_(fem.K),
      factor_(mass_ + implicit_),
      dt_(dt) {}

void NodalStepper::step(const VecX& f, NodalState& s) const {
  const VecX before = s.u_dot;
  s.u_dot = factor_.solve(mass_ * before - implicit_ * before + dt_ * (f - K_ * s.u));
  s.u += 0.5 * dt_ * (before + s.u_dot);
}

}  // namespace archetide
