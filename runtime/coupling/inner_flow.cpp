#include "runtime/coupling/inner_flow.h"

#include <array>

namespace archetide {
namespace {

using Flow = Eigen::Matrix<double, 8, 1>;  // V, then S in the basis below

// Symmetric, free of trace, orthogonal.
Mat3 strain_of(const Flow& f) {
  Mat3 S;
  S << f[3] - f[4], f[5], f[6],  //
      f[5], f[4] + f[3], f[7],   //
      f[6], f[7], -2.0 * f[3];
  return S;
}

// n . (V + S x) per unit of each parameter.
Flow normal_row(const Vec3& n, const Vec3& x) {
  Flow row;
  row << n, n[0] * x[0] + n[1] * x[1] - 2.0 * n[2] * x[2], n[1] * x[1] - n[0] * x[0],
      n[0] * x[1] + n[1] * x[0], n[0] * x[2] + n[2] * x[0], n[1] * x[2] + n[2] * x[1];
  return row;
}

}  // namespace

InnerFlow inner_flow(const Archetype& a) {
  const int r = static_cast<int>(a.surface_modes.cols());
  Eigen::Matrix<double, 8, 8> A = Eigen::Matrix<double, 8, 8>::Zero();
  Eigen::Matrix<double, 8, Eigen::Dynamic> b(8, 3 + r);
  b.setZero();
  double size = 0.0;  // lengths in this: the parameters become alike
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
  // A thin body leaves parameters open: the smallest do.
  const MatX best = A.completeOrthogonalDecomposition().solve(b);
  InnerFlow flow;
  for (int d = 0; d < 3 + r; ++d) {
    const Flow f = best.col(d);
    flow.V.push_back(f.head<3>());
    flow.S.push_back(strain_of(f) / size);
  }
  return flow;
}

PlacedInnerFlow::PlacedInnerFlow(const InnerFlow& flow, const BodySurface& s) : centre_(s.centre) {
  const int r = s.body->r;
  for (auto& rows : axis_) rows.setZero(6 + r, 4);
  for (int a = 0; a < 3; ++a) axis_[a](a, 0) = 1.0;
  const auto set = [&](int dof, const Vec3& V, const Mat3& S) {
    const Vec3 v = s.R * V;
    const Mat3 gradient = s.R * S * s.R.transpose();
    for (int a = 0; a < 3; ++a) axis_[a].row(dof) << v[a], gradient.row(a);
  };
  for (int k = 0; k < 3; ++k) {  // a spin about an axis of the world
    Vec3 V = Vec3::Zero();
    Mat3 S = Mat3::Zero();
    for (int m = 0; m < 3; ++m) V += s.R(k, m) * flow.V[m], S += s.R(k, m) * flow.S[m];
    set(3 + k, V, S);
  }
  for (int i = 0; i < r; ++i) set(6 + i, flow.V[3 + i], flow.S[3 + i]);
  for (auto& rows : axis_)
    rows.bottomRows(r).noalias() -= s.terms.spin_of_modes.transpose() * rows.middleRows<3>(3);
}

void PlacedInnerFlow::at(const Vec3& place, int axis, VecX& whole, VecX& strain) const {
  const auto& rows = axis_[axis];
  strain.noalias() = rows.rightCols<3>() * (place - centre_);
  whole = strain + rows.col(0);
}

}  // namespace archetide
