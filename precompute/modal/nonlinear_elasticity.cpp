#include "precompute/modal/nonlinear_elasticity.h"

#include "common/base/axial.h"

namespace archetide {
namespace {

struct Lame {
  double lambda, mu;
};
Lame lame(const Material& m) {
  return {m.young * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson)),
          m.young / (2.0 * (1.0 + m.poisson))};
}

/// Half of D^2 P(1)[H, H], from h'(1) = -mu, h''(1) = lambda + mu, h'''(1) = -2 mu - 3 lambda.
Mat3 second_order_stress(const Lame& m, const Mat3& H) {
  const double first = H.trace(), second = 0.5 * (first * first - (H * H).trace());
  const Mat3 turned = first * Mat3::Identity() - H.transpose();
  const double square =
      (m.lambda + m.mu) * second - 0.5 * (2.0 * m.mu + 3.0 * m.lambda) * first * first;
  return -m.mu * cofactor(H) + (m.lambda + m.mu) * first * turned + square * Mat3::Identity();
}

TetElasticity energy_of(const TetMesh& mesh, const MaterialField& material) {
  const LameField lame = lame_of_tets(material, mesh.tets.size());
  return {mesh, lame.lambda, lame.mu};
}

}  // namespace

LameField lame_of_tets(const MaterialField& material, std::size_t tets) {
  LameField out{VecX(tets), VecX(tets)};
  for (Eigen::Index t = 0; t < out.mu.size(); ++t) {
    const Lame m = lame(material.at(static_cast<int>(t)));
    out.lambda[t] = m.lambda, out.mu[t] = m.mu;
  }
  return out;
}

VecX internal_force(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  return energy_of(mesh, material).force(u);
}

ElasticState elastic_state(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  const TetElasticity V = energy_of(mesh, material);
  return {V.energy(u), V.least_volume(u)};
}

// The mixed part of the quadratic form, by polarisation.
VecX second_order_force(const TetMesh& mesh, const MaterialField& material, const VecX& u,
                        const VecX& v) {
  const TetElasticity V = energy_of(mesh, material);
  VecX f = VecX::Zero(u.size());
  for (int t = 0; t < V.tets(); ++t) {
    const int* nodes = V.nodes_of(t);
    const Lame m{V.lambda(t), V.mu(t)};
    for (int k = 0; k < V.points_in_tet(); ++k) {
      const Mat3 H = V.gradient(u, t, k), I = V.gradient(v, t, k);
      const Mat3 P = V.weight(t, k) * (second_order_stress(m, H + I) - second_order_stress(m, H) -
                                       second_order_stress(m, I));
      for (int i = 0; i < V.nodes_in_tet(); ++i)
        f.segment<3>(3L * nodes[i]) += P * V.gradients(t, k).col(i);
    }
  }
  return f;
}

std::vector<MaterialPoint> material_points(const TetMesh& mesh) {
  const VecX any = VecX::Ones(static_cast<Eigen::Index>(mesh.tets.size()));
  return TetElasticity(mesh, any, any).points();
}

ElasticCubature sampled_energy(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const std::vector<MaterialPoint>& points,
                               const VecX& scale) {
  return energy_of(mesh, material).sampled(basis, points, scale);
}

}  // namespace archetide
