#include "precompute/modal/static_responses.h"

#include <fmt/core.h>
#include <Eigen/Eigenvalues>
#include <string>

#include "common/base/input_error.h"
#include "precompute/modal/canonical_basis.h"

namespace archetide {
namespace {

constexpr double kWeakLoad = 1e-2;   // response energy next to the strongest of its kind
constexpr double kDependent = 1e-6;  // smallest eigenvalue of the responses' Gram matrix
constexpr int kMaxPasses = 200;
constexpr double kAccuracy = 1e-10;  // of the static solution, relative

double normal_displacement(const BoundaryPoint& point, const Eigen::Ref<const VecX>& mode) {
  Vec3 u = Vec3::Zero();
  for (int i = 0; i < point.count; ++i) u += point.N[i] * mode.segment<3>(3 * point.nodes[i]);
  return u.dot(point.area.normalized());
}

/// Loads of each kind: they are compared with their own kind only.
std::vector<MatX> all_loads(const TetMesh& mesh, const StaticLoads& loads, const MatX& modes) {
  const Eigen::Index n = 3 * Eigen::Index(mesh.nodes.size());
  const std::vector<BoundaryPoint> points = boundary_points(mesh);
  VecX p(Eigen::Index(points.size()));
  std::vector<MatX> kinds;
  if (loads.pressure && modes.cols() > 0) {
    MatX f(n, modes.cols());
    for (Eigen::Index k = 0; k < modes.cols(); ++k) {
      for (Eigen::Index i = 0; i < p.size(); ++i)
        p[i] = normal_displacement(points[std::size_t(i)], modes.col(k));
      f.col(k) = pressure_load(mesh, points, p);
    }
    kinds.push_back(f);
  }
  if (loads.gravity) {
    MatX f(n, 3);
    for (int axis = 0; axis < 3; ++axis) {
      for (Eigen::Index i = 0; i < p.size(); ++i) p[i] = points[std::size_t(i)].position[axis];
      f.col(axis) = pressure_load(mesh, points, p);
    }
    kinds.push_back(f);
  }
  for (const std::vector<int>& set : loads.nodes) {
    MatX f = MatX::Zero(n, 3);
    for (const int node : set)
      for (int axis = 0; axis < 3; ++axis) f(3 * node + axis, axis) += 1.0 / double(set.size());
    kinds.push_back(f);
  }
  return kinds;
}

/// K^+ f for f free of the basis: x <- x + P (K - sigma M)^-1 (f - K x), which shrinks the error by
/// |sigma| / (lambda + |sigma|), lambda the lowest eigenvalue outside the basis.
VecX solve_static(const VecX& f, const SparseMatrix& K, ShiftedCholesky& factor, const MatX& basis,
                  const MatX& weighted) {
  VecX x = VecX::Zero(f.size()), y(f.size());
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    const VecX rest = f - K * x;
    factor.solve(rest.data(), y.data());
    y -= basis * (weighted.transpose() * y);
    x += y;
    if (y.norm() <= kAccuracy * x.norm()) return x;
  }
  throw NumericsError(fmt::format("static response: no convergence in {} passes", kMaxPasses));
}

/// Responses of one kind of load, each of unit M-norm; those with almost no energy left out.
MatX responses(const MatX& loads, const SparseMatrix& K, const SparseMatrix& mass,
               ShiftedCholesky& factor, const MatX& basis, const MatX& weighted) {
  // f - M Phi Phi^T f
  const MatX f = loads - weighted * (basis.transpose() * loads);
  MatX x(f.rows(), f.cols());
  VecX energy(f.cols());
  for (Eigen::Index k = 0; k < f.cols(); ++k) {
    x.col(k) = solve_static(f.col(k), K, factor, basis, weighted);
    energy[k] = f.col(k).dot(x.col(k));
  }
  std::vector<Eigen::Index> strong;
  for (Eigen::Index k = 0; k < f.cols(); ++k)
    if (energy[k] > kWeakLoad * energy.maxCoeff()) strong.push_back(k);
  MatX kept = x(Eigen::all, strong);
  const VecX norms = (kept.array() * apply_mass(mass, kept).array()).colwise().sum().sqrt();
  return kept * norms.cwiseInverse().asDiagonal();
}

}  // namespace

MatX side_by_side(const MatX& a, const MatX& b) {
  MatX both(a.rows(), a.cols() + b.cols());
  both << a, b;
  return both;
}

StaticSolver::StaticSolver(const SparseMatrix& K, const SparseMatrix& mass, ShiftedCholesky& factor,
                           const MatX& basis)
    : K_(K), factor_(factor), basis_(basis), weighted_(apply_mass(mass, basis)) {}

VecX StaticSolver::respond(const VecX& f) const {
  return solve_static(f - weighted_ * (basis_.transpose() * f), K_, factor_, basis_, weighted_);
}

MatX rayleigh_ritz(const MatX& x, const SparseMatrix& K, const SparseMatrix& mass) {
  const Eigen::SelfAdjointEigenSolver<MatX> gram(x.transpose() * apply_mass(mass, x));
  const Eigen::Index dropped = (gram.eigenvalues().array() < kDependent).count();
  const Eigen::Index kept = x.cols() - dropped;
  const MatX basis = x * gram.eigenvectors().rightCols(kept) *
                     gram.eigenvalues().tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatX k = basis.transpose() * (K * basis), m = basis.transpose() * apply_mass(mass, basis);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> ritz(k, m);
  return basis * ritz.eigenvectors();
}

VecX pressure_load(const TetMesh& mesh, const std::vector<BoundaryPoint>& points,
                   const VecX& pressure) {
  VecX f = VecX::Zero(3 * Eigen::Index(mesh.nodes.size()));
  for (std::size_t k = 0; k < points.size(); ++k)
    for (int i = 0; i < points[k].count; ++i)
      f.segment<3>(3 * points[k].nodes[i]) -=
          points[k].N[i] * pressure[Eigen::Index(k)] * points[k].area;
  return f;
}

// Eq. P5.
MatX static_responses(const TetMesh& mesh, const StaticLoads& loads, const SparseMatrix& K,
                      const SparseMatrix& mass, ShiftedCholesky& factor, const MatX& rigid,
                      const MatX& modes) {
  const MatX basis = side_by_side(rigid, modes), weighted = apply_mass(mass, basis);
  MatX all(K.rows(), 0);
  for (const MatX& kind : all_loads(mesh, loads, modes))
    all = side_by_side(all, responses(kind, K, mass, factor, basis, weighted));
  if (all.cols() == 0) return all;
  MatX result = rayleigh_ritz(all, K, mass);
  for (int pass = 0; pass < 2; ++pass) result -= basis * (weighted.transpose() * result);
  canonicalise_signs(result);
  return result;
}

}  // namespace archetide
