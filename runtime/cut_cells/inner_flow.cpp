#include "runtime/cut_cells/inner_flow.h"

#include <cmath>

namespace archetide {
namespace {

constexpr int kTerms = 15;                      // 3 of V, 5 of S, 7 of T
using Flow = Eigen::Matrix<double, kTerms, 1>;  // shares of the terms below

// Symmetric, free of trace, orthogonal.
Mat3 strain_of(const Flow& f) {
  Mat3 S;
  S << f[3] - f[4], f[5], f[6],  //
      f[5], f[4] + f[3], f[7],   //
      f[6], f[7], -2.0 * f[3];
  return S;
}

// A term of a polynomial of degree 3, factor x_i x_j x_k.
struct Monomial {
  double factor;
  int i, j, k;
};

// The harmonic ones, orthogonal on spheres.
const std::vector<std::vector<Monomial>>& cubic_harmonics() {
  static const std::vector<std::vector<Monomial>> all = {
      {{1.0, 0, 0, 0}, {-3.0, 0, 1, 1}},
      {{1.0, 1, 1, 1}, {-3.0, 0, 0, 1}},
      {{2.0, 2, 2, 2}, {-3.0, 0, 0, 2}, {-3.0, 1, 1, 2}},
      {{4.0, 0, 2, 2}, {-1.0, 0, 0, 0}, {-1.0, 0, 1, 1}},
      {{4.0, 1, 2, 2}, {-1.0, 0, 0, 1}, {-1.0, 1, 1, 1}},
      {{1.0, 0, 0, 2}, {-1.0, 1, 1, 2}},
      {{1.0, 0, 1, 2}}};
  return all;
}

// Gradient of such a polynomial, as T.
InnerFlow::Cubic gradient_of(const std::vector<Monomial>& polynomial) {
  InnerFlow::Cubic T = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
  for (const Monomial& m : polynomial) {
    const int p[3] = {m.i, m.j, m.k};
    for (int a = 0; a < 3; ++a) {  // p[a] is differentiated, the others stay
      const int b = p[(a + 1) % 3], c = p[(a + 2) % 3];
      T[p[a]](b, c) += 0.5 * m.factor, T[p[a]](c, b) += 0.5 * m.factor;
    }
  }
  return T;
}

const std::vector<InnerFlow::Cubic>& cubic_flows() {
  static const std::vector<InnerFlow::Cubic> all = [] {
    std::vector<InnerFlow::Cubic> flows;
    for (const auto& polynomial : cubic_harmonics()) flows.push_back(gradient_of(polynomial));
    return flows;
  }();
  return all;
}

// n . v per unit of each term.
Flow normal_row(const Vec3& n, const Vec3& x) {
  Flow row;
  row.head<8>() << n, n[0] * x[0] + n[1] * x[1] - 2.0 * n[2] * x[2], n[1] * x[1] - n[0] * x[0],
      n[0] * x[1] + n[1] * x[0], n[0] * x[2] + n[2] * x[0], n[1] * x[2] + n[2] * x[1];
  for (int t = 0; t < 7; ++t) {
    row[8 + t] = 0.0;
    for (int a = 0; a < 3; ++a) row[8 + t] += n[a] * x.dot(cubic_flows()[t][a] * x);
  }
  return row;
}

}  // namespace

InnerFlow inner_flow(const Archetype& a) {
  const int r = static_cast<int>(a.surface_modes.cols());
  Eigen::Matrix<double, kTerms, kTerms> A = Eigen::Matrix<double, kTerms, kTerms>::Zero();
  Eigen::Matrix<double, kTerms, Eigen::Dynamic> b(kTerms, 3 + r);
  b.setZero();
  double size = 0.0;  // lengths in this: the terms become alike
  for (const Vec3& x : a.surface.vertices) size = std::max(size, x.norm());
  for (const Vec3i& t : a.surface.triangles) {
    const Vec3 &p = a.surface.vertices[t[0]], &q = a.surface.vertices[t[1]],
               &s = a.surface.vertices[t[2]];
    const Vec3 area = 0.5 * (q - p).cross(s - p), n = area.stableNormalized();
    for (int v = 0; v < 3; ++v) {
      const Vec3& x = a.surface.vertices[t[v]];
      const Flow row = normal_row(n, x / size);
      const double weight = area.norm() / 3.0;
      A += weight * row * row.transpose();
      b.leftCols<3>() += weight * row * x.cross(n).transpose();  // n . (w x x) = w . (x x n)
      if (r > 0)
        b.rightCols(r) += weight * row * (n.transpose() * a.surface_modes.middleRows<3>(3 * t[v]));
    }
  }
  // A thin body leaves terms open: the smallest do.
  const auto decomposed = A.completeOrthogonalDecomposition();
  InnerFlow flow;
  for (int d = 0; d < 3 + r; ++d) {
    const Flow f = decomposed.solve(b.col(d));  // one by one: not the bits of how many there are
    flow.V.push_back(f.head<3>());
    flow.S.push_back(strain_of(f) / size);
    InnerFlow::Cubic T = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
    for (int t = 0; t < 7; ++t)
      for (int axis = 0; axis < 3; ++axis)
        T[axis] += f[8 + t] / (size * size) * cubic_flows()[t][axis];
    flow.T.push_back(T);
  }
  return flow;
}

PlacedInnerFlow::PlacedInnerFlow(const InnerFlow& flow, const BodySurface& s) : centre_(s.centre) {
  const int r = reduced_dofs(*s.body) - 6;
  const MatX& spin_of_modes = s.nodes ? s.nodes->spin_of_modes() : s.terms.spin_of_modes;
  for (auto& rows : axis_) rows.setZero(6 + r, 10);
  for (int a = 0; a < 3; ++a) axis_[a](a, 0) = 1.0;
  // Motion m of the rest frame, in the world, times `share` to that of a degree of freedom.
  const auto add = [&](int dof, double share, int m) {
    const Vec3 v = share * (s.R * flow.V[m]);
    const Mat3 gradient = share * (s.R * flow.S[m] * s.R.transpose());
    Mat3 turned[3];
    for (int b = 0; b < 3; ++b) turned[b] = share * (s.R * flow.T[m][b] * s.R.transpose());
    for (int a = 0; a < 3; ++a) {
      const Mat3 T = s.R(a, 0) * turned[0] + s.R(a, 1) * turned[1] + s.R(a, 2) * turned[2];
      auto row = axis_[a].row(dof);
      row[0] += v[a];
      row.segment<3>(1) += gradient.row(a);
      row.segment<3>(4) += T.diagonal();
      row.tail<3>() += 2.0 * Vec3(T(0, 1), T(0, 2), T(1, 2));
    }
  };
  for (int k = 0; k < 3; ++k)  // a spin about an axis of the world
    for (int m = 0; m < 3; ++m) add(3 + k, s.R(k, m), m);
  for (int i = 0; i < r; ++i) add(6 + i, 1.0, 3 + i);
  for (auto& rows : axis_)
    rows.bottomRows(r).noalias() -= spin_of_modes.transpose() * rows.middleRows<3>(3);
}

void PlacedInnerFlow::at(const Vec3& place, int axis, VecX& whole, VecX& strain) const {
  const auto& rows = axis_[axis];
  const Vec3 x = place - centre_;
  Eigen::Matrix<double, 6, 1> squares;
  squares << x.cwiseProduct(x), x[0] * x[1], x[0] * x[2], x[1] * x[2];
  whole.noalias() = rows.rightCols<6>() * squares;
  strain.noalias() = rows.middleCols<3>(1) * x;
  strain += std::sqrt(2.0) * whole;
  whole += rows.col(0) + rows.middleCols<3>(1) * x;
}

}  // namespace archetide
