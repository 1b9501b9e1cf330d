#include "runtime/solid/inversion_limit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <map>
#include <vector>

#include "common/base/axial.h"
#include "common/mesh/tet_shape.h"

namespace archetide {
namespace {

/// Gradients (with respect to L) at the points where F is looked at.
template <int N>
std::vector<typename TetShape<N>::Gradients> gradients_at_points();

template <>
std::vector<TetShape<4>::Gradients> gradients_at_points<4>() {
  return {TetShape<4>::gradients(Vec3::Zero())};
}

template <>
std::vector<TetShape<10>::Gradients> gradients_at_points<10>() {
  const std::array<Vec3, 4> corners = {Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  std::vector<TetShape<10>::Gradients> at;
  for (const Vec3& L : corners) at.push_back(TetShape<10>::gradients(L));
  for (const auto& [p, q] : kTetEdges)
    at.push_back(TetShape<10>::gradients(0.5 * (corners[p] + corners[q])));
  return at;
}

/// Calls visit(nodes, G_of, grad u) at every point of a tet where u_of(node) is the displacement
/// (m); G_of(): 3 x N gradients of the shape functions, 1/m.
template <int N, class Displacement, class Visit>
void visit_tet(const TetMesh& mesh, int t, const Displacement& u_of, const Visit& visit) {
  static const auto at_points = gradients_at_points<N>();
  const std::array<int, N> nodes = element_nodes<N>(mesh, t);
  const Eigen::Matrix<double, 3, N> x = element_positions<N>(mesh, nodes);
  Eigen::Matrix<double, 3, N> moved;
  for (int a = 0; a < N; ++a) moved.col(a) = u_of(nodes[a]);
  for (const auto& dN_dL : at_points) {
    const Mat3 dx_dL = x * dN_dL.transpose(), dL_dx = dx_dL.inverse();
    const auto G_of = [&]() -> Eigen::Matrix<double, 3, N> { return dL_dx.transpose() * dN_dL; };
    visit(nodes, G_of, Mat3(Mat3(moved * dN_dL.transpose()) * dL_dx));
  }
}

template <class Displacement, class Visit>
void visit_tet(const TetMesh& mesh, int t, const Displacement& u_of, const Visit& visit) {
  if (mesh.order() == 1)
    visit_tet<4>(mesh, t, u_of, visit);
  else
    visit_tet<10>(mesh, t, u_of, visit);
}

/// The same at every tet, of the node field u (3 n, m).
template <class Visit>
void visit_gradients(const TetMesh& mesh, const VecX& u, const Visit& visit) {
  const auto u_of = [&](int node) { return u.segment<3>(3 * node); };
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) visit_tet(mesh, t, u_of, visit);
}

/// tr cof A, the second invariant.
double second_invariant(const Mat3& A) {
  return 0.5 * (A.trace() * A.trace() - A.cwiseProduct(A.transpose()).sum());
}

/// What the motion of the nodes does to what is limited at one point: d/dt det F = cof F : grad u'
/// = sum f_a . u'_a with f_a = cof F grad N_a; -d/dt |A|^2 / 2 = -A : grad u' with A = grad u.
struct Closing {
  std::vector<int> nodes;
  std::vector<Vec3> f;  // 1/m, one per node

  double rate(const VecX& u_dot) const {  // 1/s
    double sum = 0.0;
    for (std::size_t a = 0; a < nodes.size(); ++a) sum += f[a].dot(u_dot.segment<3>(3 * nodes[a]));
    return sum;
  }
  /// The same for each mode, r.
  VecX on_modes(const Eigen::Ref<const MatX>& modes) const {
    VecX n = VecX::Zero(modes.cols());
    for (std::size_t a = 0; a < nodes.size(); ++a)
      n.noalias() += modes.middleRows<3>(3 * nodes[a]).transpose() * f[a];
    return n;
  }
};

std::vector<Closing> elements_at_limit(const TetMesh& mesh, const VecX& u, double close) {
  std::vector<Closing> near;
  visit_gradients(mesh, u, [&](const auto& nodes, const auto& G_of, const Mat3& A) {
    const auto add = [&](const Mat3& slope) {
      Closing c{{nodes.begin(), nodes.end()}, {}};
      const auto G = G_of();
      for (std::size_t a = 0; a < nodes.size(); ++a)
        c.f.push_back(slope * G.col(static_cast<Eigen::Index>(a)));
      near.push_back(std::move(c));
    };
    const Mat3 F = Mat3::Identity() + A;
    if (F.determinant() <= InversionLimit::kLeastVolume + close) add(cofactor(F));
    if (A.norm() >= (1.0 - close) * InversionLimit::kLargestGradient) add(-A);
  });
  return near;
}

/// First root in (0, 1] of f(s) = c0 + s (c1 + s (c2 + s c3)) with f(0) > 0, from the side where f
/// >= 0; 1 where there is none.
double first_root(double c0, double c1, double c2, double c3) {
  const auto f = [&](double s) { return c0 + s * (c1 + s * (c2 + s * c3)); };
  // f is monotone between the roots of f' = c1 + 2 c2 s + 3 c3 s²
  std::array<double, 3> ends = {1.0, 1.0, 1.0};
  const double d = c2 * c2 - 3.0 * c1 * c3;
  if (d > 0.0) {
    const double h = -(c2 + std::copysign(std::sqrt(d), c2));
    const double p = h / (3.0 * c3), q = c1 / h;  // infinite where f' is linear
    if (p > 0.0 && p < 1.0) ends[0] = p;
    if (q > 0.0 && q < 1.0) ends[1] = q;
    if (ends[0] > ends[1]) std::swap(ends[0], ends[1]);
  }
  double low = 0.0;
  for (double high : ends) {
    if (f(high) >= 0.0) {
      low = high;
      continue;
    }
    while (high - low > 1e-15 * high) {
      const double middle = 0.5 * (low + high);
      if (middle <= low || middle >= high) break;
      (f(middle) >= 0.0 ? low : high) = middle;
    }
    return low;
  }
  return 1.0;
}

/// Principal stretches of at least this leave the volume kLeastVolume.
double harmless_gradient() { return 1.0 - std::cbrt(InversionLimit::kLeastVolume); }

}  // namespace

InversionLimit::InversionLimit(const Archetype& archetype)
    : archetype_(archetype), steepest_(VecX::Zero(archetype.node_modes.cols())) {
  constexpr float kRoundUp = 1.0f + 1e-6f;
  const TetMesh& mesh = archetype.tets;
  steep_.setZero(static_cast<Eigen::Index>(mesh.tets.size()), steepest_.size());
  for (Eigen::Index i = 0; i < steep_.cols(); ++i)
    for (int t = 0; t < static_cast<int>(steep_.rows()); ++t) {
      double most = 0.0;
      visit_tet(
          mesh, t, [&](int node) { return archetype.node_modes.col(i).segment<3>(3 * node); },
          [&](const auto&, const auto&, const Mat3& A) { most = std::max(most, A.norm()); });
      steepest_[i] = std::max(steepest_[i], most);
      steep_(t, i) = kRoundUp * static_cast<float>(most);
    }
}

VecX InversionLimit::displacement(const VecX& q) const {
  return archetype_.node_modes.leftCols(q.size()) * q;
}

bool InversionLimit::surely_holds(const VecX& q) const {
  if (steepest_.size() == 0) return true;
  return q.cwiseAbs().dot(steepest_.head(q.size())) <= harmless_gradient();
}

// Those for which the bound of surely_holds, with their own gradients, does not hold.
std::vector<int> InversionLimit::doubtful_tets(const VecX& q) const {
  const auto harmless = static_cast<float>(harmless_gradient() * (1.0 - 1e-5));  // of rounding
  const Eigen::VectorXf bound = steep_.leftCols(q.size()) * q.cwiseAbs().cast<float>();
  std::vector<int> tets;
  for (Eigen::Index t = 0; t < bound.size(); ++t)
    if (!(bound[t] <= harmless)) tets.push_back(static_cast<int>(t));
  return tets;
}

double InversionLimit::allowed_share(const VecX& q) const {
  if (surely_holds(q) || !q.allFinite()) return 1.0;
  double share = 1.0;
  const double harmless = std::pow(harmless_gradient(), 2);
  const TetMesh& mesh = archetype_.tets;
  const std::vector<int> tets = doubtful_tets(q);
  // A tet reads ten nodes, or four: of many tets all nodes are dealt with at once.
  const std::size_t read = tets.size() * (mesh.order() == 1 ? 4 : 10);
  const VecX all = read > mesh.nodes.size() ? displacement(q) : VecX();
  const auto u_of = [&](int node) -> Vec3 {
    if (all.size() > 0) return all.segment<3>(3 * node);
    return archetype_.node_modes.middleRows<3>(3 * node).leftCols(q.size()) * q;
  };
  const auto look = [&](const auto&, const auto&, const Mat3& A) {
    if (A.squaredNorm() <= harmless) return;
    // det(1 + s A) = 1 + s tr A + s² tr cof A + s³ det A
    share = std::min(
        {share, first_root(1.0 - kLeastVolume, A.trace(), second_invariant(A), A.determinant()),
         kLargestGradient / A.norm()});
  };
  for (const int t : tets) visit_tet(mesh, t, u_of, look);
  return share;
}

double InversionLimit::least_volume(const VecX& q) const {
  if (steepest_.size() == 0) return 1.0;
  double least = INFINITY;
  visit_gradients(archetype_.tets, displacement(q), [&](const auto&, const auto&, const Mat3& A) {
    least = std::min(least, (Mat3::Identity() + A).determinant());
  });
  return least;
}

double InversionLimit::largest_gradient(const VecX& q) const {
  double largest = 0.0;
  visit_gradients(archetype_.tets, displacement(q), [&](const auto&, const auto&, const Mat3& A) {
    largest = std::max(largest, A.norm());
  });
  return largest;
}

MatX InversionLimit::stop_closing(const VecX& q, const MatX& M_q, VecX& q_dot) const {
  constexpr double kClose = 0.01;    // of the volume or the gradient: the element stands there
  constexpr double kStopped = 1e-9;  // of the fastest closing
  const auto modes = archetype_.node_modes.leftCols(q.size());
  const std::vector<Closing> near = elements_at_limit(archetype_.tets, modes * q, kClose);
  const Eigen::LDLT<MatX> mass(M_q);
  double fastest = 0.0;  // closing at first, 1/s
  std::map<const Closing*, VecX> stopped;
  for (Eigen::Index turn = 0; turn < 100 + 4 * q.size(); ++turn) {
    const VecX u_dot = modes * q_dot;
    double worst = 0.0;
    const Closing* at = nullptr;
    for (const Closing& c : near)
      if (const double rate = c.rate(u_dot); rate < worst) worst = rate, at = &c;
    fastest = std::max(fastest, -worst);
    if (!at || -worst <= kStopped * fastest) break;
    const VecX n = at->on_modes(modes), push = mass.solve(n);
    stopped[at] = n;
    q_dot -= push * (n.dot(q_dot) / n.dot(push));
  }
  MatX normals(q.size(), static_cast<Eigen::Index>(stopped.size()));
  Eigen::Index k = 0;
  for (const auto& [closing, n] : stopped) normals.col(k++) = n;
  return normals;
}

}  // namespace archetide
