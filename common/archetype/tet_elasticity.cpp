#include "common/archetype/tet_elasticity.h"

#include <Eigen/LU>
#include <algorithm>

#include "common/archetype/elastic_cubature.h"
#include "common/base/axial.h"
#include "common/base/check.h"
#include "common/mesh/tet_rule.h"

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

// What a point needs of F: cof F and h(det F).
struct Stretch {
  Mat3 F, cof;
  double J;

  explicit Stretch(const Mat3& gradient)
      : F(Mat3::Identity() + gradient), cof(cofactor(F)), J(F.col(0).dot(cof.col(0))) {}
};

}  // namespace

TetElasticity::TetElasticity(const TetMesh& mesh, VecX lambda, VecX mu)
    : size_(3 * static_cast<int>(mesh.nodes.size())),
      lambda_(std::move(lambda)),
      mu_(std::move(mu)) {
  const auto tets = static_cast<Eigen::Index>(mesh.tets.size());
  ARCHETIDE_CHECK(lambda_.size() == tets && mu_.size() == tets);
  if (mesh.order() == 1)
    sample<4>(mesh);
  else
    sample<10>(mesh);
}

template <int N>
void TetElasticity::sample(const TetMesh& mesh) {
  const ShapeTable<N>& rule = energy_rule<N>();
  nodes_ = N, points_ = static_cast<int>(rule.values.size());
  node_.reserve(mesh.tets.size() * N);
  gradients_.resize(3, static_cast<long>(tets()) * points_ * N);
  weight_.resize(static_cast<long>(tets()) * points_);
  long point = 0;
  for (int t = 0; t < tets(); ++t) {
    const std::array<int, N> nodes = element_nodes<N>(mesh, t);
    node_.insert(node_.end(), nodes.begin(), nodes.end());
    const auto x = element_positions<N>(mesh, nodes);
    for (int k = 0; k < points_; ++k, ++point) {
      const Mat3 J = x * rule.gradients[k].transpose();
      gradients_.middleCols<N>(point * N) = J.inverse().transpose() * rule.gradients[k];
      weight_[point] = rule.rule.weights[k] * J.determinant();
    }
  }
}

// work(tet, nodes, gradients, weight, du/dx) at every point.
template <int N, class Work>
void TetElasticity::at_every_point(const VecX& u, const Work& work) const {
  long point = 0;
  for (int t = 0; t < tets(); ++t) {
    const int* nodes = nodes_of(t);
    Eigen::Matrix<double, 3, N> own;
    for (int i = 0; i < N; ++i) own.col(i) = u.segment<3>(3L * nodes[i]);
    for (int k = 0; k < points_; ++k, ++point) {
      const Eigen::Map<const Eigen::Matrix<double, 3, N>> g(gradients_.data() + 3 * point * N);
      work(t, nodes, g, weight_[point], Mat3(own * g.transpose()));
    }
  }
}

template <class Work>
void TetElasticity::at_points_of_any(const VecX& u, const Work& work) const {
  if (nodes_ == 4)
    at_every_point<4>(u, work);
  else
    at_every_point<10>(u, work);
}

double TetElasticity::energy(const VecX& u) const {
  double sum = 0.0;
  at_points_of_any(u, [&](int t, const int*, const auto&, double w, const Mat3& gradient) {
    const Stretch at(gradient);
    sum += w * (0.5 * mu_[t] * (at.F.squaredNorm() - 3.0) +
                NeoHookean::volumetric(lambda_[t], mu_[t], at.J).h);
  });
  return sum;
}

double TetElasticity::least_volume(const VecX& u) const {
  double least = 1.0;
  at_points_of_any(u, [&](int, const int*, const auto&, double, const Mat3& gradient) {
    least = std::min(least, Stretch(gradient).J);
  });
  return least;
}

// w P(F), P(F) = mu F + h'(J) cof F.
VecX TetElasticity::force(const VecX& u) const {
  VecX f = VecX::Zero(size_);
  at_points_of_any(u, [&](int t, const int* nodes, const auto& g, double w, const Mat3& gradient) {
    const Stretch at(gradient);
    const Mat3 P = w * (mu_[t] * at.F + NeoHookean::slope(lambda_[t], mu_[t], at.J) * at.cof);
    for (int i = 0; i < g.cols(); ++i) f.segment<3>(3L * nodes[i]) += P * g.col(i);
  });
  return f;
}

std::vector<int> TetElasticity::places_in(const TetMatrices& m) const {
  std::vector<int> places;
  places.reserve(static_cast<std::size_t>(tets()) * nodes_ * (nodes_ + 1) / 2);
  for (int t = 0; t < tets(); ++t) {
    const int* nodes = nodes_of(t);
    for (int i = 0; i < nodes_; ++i)
      for (int j = 0; j <= i; ++j) {
        const int p = std::max(nodes[i], nodes[j]), q = std::min(nodes[i], nodes[j]);
        const auto begin = m.column.begin() + m.row_begin(p), end = m.column.begin() + m.row_end(p);
        const auto at = std::lower_bound(begin, end, q);
        ARCHETIDE_CHECK(at != end && *at == q);
        places.push_back(static_cast<int>(at - m.column.begin()));
      }
  }
  return places;
}

// Of nodes i and j with the gradients g: w (mu g_i.g_j + h'' c_i c_j^T - h' [F (g_i x g_j)]), c = cof F g:
// the change of cof F along a g_j^T takes g_i to a x F (g_i x g_j).
void TetElasticity::add_stiffness(const VecX& u, double factor, const std::vector<int>& places,
                                  std::vector<Mat3>& blocks) const {
  ARCHETIDE_CHECK(places.size() == static_cast<std::size_t>(tets()) * nodes_ * (nodes_ + 1) / 2);
  at_points_of_any(u, [&](int t, const int* nodes, const auto& g, double w, const Mat3& gradient) {
    const Stretch at(gradient);
    const auto h = NeoHookean::volumetric(lambda_[t], mu_[t], at.J);
    const double shear = factor * w * mu_[t], slope = factor * w * h.slope,
                 curvature = factor * w * h.curvature;
    const auto c = (at.cof * g).eval();
    const int* place = &places[static_cast<std::size_t>(t) * nodes_ * (nodes_ + 1) / 2];
    for (int i = 0; i < g.cols(); ++i)
      for (int j = 0; j <= i; ++j, ++place) {
        const int row = nodes[i] >= nodes[j] ? i : j, column = nodes[i] >= nodes[j] ? j : i;
        const Vec3 across = slope * (at.F * g.col(row).cross(g.col(column)));
        Mat3& block = blocks[static_cast<std::size_t>(*place)];
        block.noalias() += (curvature * c.col(row)) * c.col(column).transpose();
        block -= skew(across);
        block.diagonal().array() += shear * g.col(row).dot(g.col(column));
      }
  });
}

Mat3 TetElasticity::gradient(const Eigen::Ref<const VecX>& u, int tet, int k) const {
  const auto g = gradients(tet, k);
  const int* nodes = nodes_of(tet);
  Mat3 H = Mat3::Zero();
  for (int i = 0; i < nodes_; ++i) H += u.segment<3>(3L * nodes[i]) * g.col(i).transpose();
  return H;
}

std::vector<TetElasticity::Point> TetElasticity::points() const {
  std::vector<Point> all;
  for (int t = 0; t < tets(); ++t)
    for (int k = 0; k < points_; ++k) all.push_back({t, k});
  return all;
}

ElasticCubature TetElasticity::sampled(const MatX& basis, const std::vector<Point>& points,
                                       const VecX& scale) const {
  const auto P = static_cast<Eigen::Index>(points.size());
  MatX gradients(9 * P, basis.cols());
  VecX weights(P), lambda(P), mu(P);
  for (Eigen::Index p = 0; p < P; ++p) {
    const Point& at = points[static_cast<std::size_t>(p)];
    weights[p] = scale[p] * weight(at.tet, at.point);
    lambda[p] = lambda_[at.tet], mu[p] = mu_[at.tet];
    for (Eigen::Index i = 0; i < basis.cols(); ++i) {
      const Mat3 H = gradient(basis.col(i), at.tet, at.point);
      for (int c = 0; c < 3; ++c)
        for (int a = 0; a < 3; ++a) gradients((3 * c + a) * P + p, i) = H(a, c);
    }
  }
  return ElasticCubature(std::move(gradients), std::move(weights), std::move(lambda),
                         std::move(mu));
}

std::size_t TetElasticity::bytes() const {
  return sizeof(double) * static_cast<std::size_t>(gradients_.size() + weight_.size() +
                                                   lambda_.size() + mu_.size()) +
         sizeof(int) * node_.size();
}

}  // namespace archetide
