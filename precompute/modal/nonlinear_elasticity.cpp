#include "precompute/modal/nonlinear_elasticity.h"

#include <Eigen/LU>
#include <algorithm>

#include "precompute/base/tet_element.h"

namespace archetide {
namespace {

template <int N>
const ShapeTable<N>& energy_rule();
template <>
const ShapeTable<4>& energy_rule<4>() {
  static const ShapeTable<4> rule(conical_rule(1));
  return rule;
}
template <>
const ShapeTable<10>& energy_rule<10>() {
  static const ShapeTable<10> rule(four_point_rule());
  return rule;
}

/// The gradients of the shape functions (3 x N, 1/m) and the weight (m^3) at point k of a tet.
template <int N>
struct PointGeometry {
  Eigen::Matrix<double, 3, N> gradients;
  double weight;

  PointGeometry(const Eigen::Matrix<double, 3, N>& x, std::size_t k) {
    const ShapeTable<N>& rule = energy_rule<N>();
    const Mat3 J = x * rule.gradients[k].transpose();
    gradients = J.inverse().transpose() * rule.gradients[k];
    weight = rule.rule.weights[k] * J.determinant();
  }
};

/// Calls work(tet, nodes, geometry) at every point.
template <int N, class Work>
void at_every_point(const TetMesh& mesh, const Work& work) {
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const std::array<int, N> nodes = element_nodes<N>(mesh, t);
    const auto x = element_positions<N>(mesh, nodes);
    for (std::size_t k = 0; k < energy_rule<N>().values.size(); ++k)
      work(t, nodes, PointGeometry<N>(x, k));
  }
}

/// grad u at a point: du_a / dx_c.
template <int N>
Mat3 gradient(const VecX& u, const std::array<int, N>& nodes, const PointGeometry<N>& at) {
  Mat3 H = Mat3::Zero();
  for (int i = 0; i < N; ++i) H += u.segment<3>(3 * nodes[i]) * at.gradients.col(i).transpose();
  return H;
}

template <int N>
void add_stress(const Mat3& P, const std::array<int, N>& nodes, const PointGeometry<N>& at,
                VecX& f) {
  for (int i = 0; i < N; ++i) f.segment<3>(3 * nodes[i]) += at.weight * (P * at.gradients.col(i));
}

struct Lame {
  double lambda, mu;
};
Lame lame(const Material& m) {
  return {m.young * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson)),
          m.young / (2.0 * (1.0 + m.poisson))};
}

Mat3 cofactor(const Mat3& F) {
  Mat3 c;
  c << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
  return c;
}

/// P(F) = mu F + h'(J) cof F.
Mat3 stress(const Lame& m, const Mat3& F) {
  const Mat3 c = cofactor(F);
  const double J = F.col(0).dot(c.col(0));
  return m.mu * F + NeoHookean::volumetric(m.lambda, m.mu, J).slope * c;
}

/// Half of D^2 P(1)[H, H], from h'(1) = -mu, h''(1) = lambda + mu, h'''(1) = -2 mu - 3 lambda.
Mat3 second_order_stress(const Lame& m, const Mat3& H) {
  const double first = H.trace(), second = 0.5 * (first * first - (H * H).trace());
  const Mat3 turned = first * Mat3::Identity() - H.transpose();
  const double square =
      (m.lambda + m.mu) * second - 0.5 * (2.0 * m.mu + 3.0 * m.lambda) * first * first;
  return -m.mu * cofactor(H) + (m.lambda + m.mu) * first * turned + square * Mat3::Identity();
}

template <int N>
VecX force(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  VecX f = VecX::Zero(u.size());
  at_every_point<N>(mesh, [&](int t, const auto& nodes, const PointGeometry<N>& at) {
    const Mat3 F = Mat3::Identity() + gradient<N>(u, nodes, at);
    add_stress<N>(stress(lame(material.at(t)), F), nodes, at, f);
  });
  return f;
}

template <int N>
ElasticState state(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  ElasticState s;
  at_every_point<N>(mesh, [&](int t, const auto& nodes, const PointGeometry<N>& at) {
    const Mat3 F = Mat3::Identity() + gradient<N>(u, nodes, at);
    const Lame m = lame(material.at(t));
    const double J = F.determinant();
    s.least_volume = std::min(s.least_volume, J);
    s.energy += at.weight * (0.5 * m.mu * (F.squaredNorm() - 3.0) +
                             NeoHookean::volumetric(m.lambda, m.mu, J).h);
  });
  return s;
}

// The mixed part of the quadratic form, by polarisation.
template <int N>
VecX second_order(const TetMesh& mesh, const MaterialField& material, const VecX& u,
                  const VecX& v) {
  VecX f = VecX::Zero(u.size());
  at_every_point<N>(mesh, [&](int t, const auto& nodes, const PointGeometry<N>& at) {
    const Mat3 H = gradient<N>(u, nodes, at), I = gradient<N>(v, nodes, at);
    const Lame m = lame(material.at(t));
    add_stress<N>(
        second_order_stress(m, H + I) - second_order_stress(m, H) - second_order_stress(m, I),
        nodes, at, f);
  });
  return f;
}

template <int N>
ElasticCubature sampled(const TetMesh& mesh, const MaterialField& material, const MatX& basis,
                        const std::vector<MaterialPoint>& points, const VecX& scale) {
  const auto P = Eigen::Index(points.size());
  MatX gradients(9 * P, basis.cols());
  VecX weights(P), lambda(P), mu(P);
  for (Eigen::Index p = 0; p < P; ++p) {
    const MaterialPoint& at = points[std::size_t(p)];
    const std::array<int, N> nodes = element_nodes<N>(mesh, at.tet);
    const PointGeometry<N> place(element_positions<N>(mesh, nodes), std::size_t(at.point));
    const Lame m = lame(material.at(at.tet));
    weights[p] = scale[p] * place.weight, lambda[p] = m.lambda, mu[p] = m.mu;
    for (Eigen::Index i = 0; i < basis.cols(); ++i) {
      Mat3 H = Mat3::Zero();
      for (int k = 0; k < N; ++k)
        H += basis.block<3, 1>(3 * nodes[k], i) * place.gradients.col(k).transpose();
      for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a) gradients((3 * c + a) * P + p, i) = H(a, c);
    }
  }
  return ElasticCubature(std::move(gradients), std::move(weights), std::move(lambda),
                         std::move(mu));
}

}  // namespace

VecX internal_force(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  return mesh.order() == 1 ? force<4>(mesh, material, u) : force<10>(mesh, material, u);
}

ElasticState elastic_state(const TetMesh& mesh, const MaterialField& material, const VecX& u) {
  return mesh.order() == 1 ? state<4>(mesh, material, u) : state<10>(mesh, material, u);
}

VecX second_order_force(const TetMesh& mesh, const MaterialField& material, const VecX& u,
                        const VecX& v) {
  return mesh.order() == 1 ? second_order<4>(mesh, material, u, v)
                           : second_order<10>(mesh, material, u, v);
}

std::vector<MaterialPoint> material_points(const TetMesh& mesh) {
  const int each =
      int(mesh.order() == 1 ? energy_rule<4>().values.size() : energy_rule<10>().values.size());
  std::vector<MaterialPoint> points;
  for (int t = 0; t < int(mesh.tets.size()); ++t)
    for (int k = 0; k < each; ++k) points.push_back({t, k});
  return points;
}

ElasticCubature sampled_energy(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const std::vector<MaterialPoint>& points,
                               const VecX& scale) {
  return mesh.order() == 1 ? sampled<4>(mesh, material, basis, points, scale)
                           : sampled<10>(mesh, material, basis, points, scale);
}

}  // namespace archetide
