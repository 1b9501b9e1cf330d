#include "precompute/modal/nonlinear_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "precompute/modal/canonical_basis.h"
#include "precompute/modal/nonlinear_elasticity.h"
#include "precompute/modal/static_responses.h"

namespace archetide {
namespace {

/// What is orthogonal in M to the basis, twice for round-off.
void remove(const MatX& basis, const SparseMatrix& mass, MatX& x) {
  const MatX weighted = apply_mass(mass, basis);
  for (int pass = 0; pass < 2; ++pass) x -= basis * (weighted.transpose() * x);
}

/// u = E x with the six unit strains E.
MatX uniform_strains(const std::vector<Vec3>& nodes) {
  MatX u(3 * Eigen::Index(nodes.size()), 6);
  for (std::size_t v = 0; v < nodes.size(); ++v)
    for (int k = 0; k < 6; ++k) {
      const int a = k % 3, b = k < 3 ? a : (a + 1) % 3;
      Mat3 E = Mat3::Zero();
      E(a, b) = E(b, a) = 1.0;
      u.block<3, 1>(3 * Eigen::Index(v), k) = E * nodes[v];
    }
  return u;
}

/// Directions of x (3n x m) of the largest M-norm, at most `count`; M-orthonormal.
MatX principal_components(const MatX& x, const SparseMatrix& mass, Eigen::Index count) {
  constexpr double kDependent = 1e-10;  // of the largest eigenvalue
  const Eigen::SelfAdjointEigenSolver<MatX> gram(x.transpose() * apply_mass(mass, x));
  const VecX& values = gram.eigenvalues();
  const Eigen::Index independent = (values.array() > kDependent * values.maxCoeff()).count();
  const Eigen::Index kept = std::min(count, independent);
  return x * gram.eigenvectors().rightCols(kept) *
         values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// X_ij of all pairs, weighted; free of the basis, whose own part of them the basis has already.
MatX weighted_derivatives(const TetMesh& mesh, const MaterialField& material,
                          const StaticSolver& solver, const MatX& modes, const VecX& omega2,
                          int vibration) {
  MatX x(modes.rows(), vibration * (vibration + 1) / 2);
  Eigen::Index column = 0;
  for (int i = 0; i < vibration; ++i)
    for (int j = 0; j <= i; ++j) {
      const VecX f = second_order_force(mesh, material, modes.col(i), modes.col(j));
      const double weight = omega2[0] * omega2[0] / (omega2[i] * omega2[j]);
      x.col(column++) = -weight * solver.respond(f);
    }
  return x;
}

}  // namespace

// Eq. P5a.
MatX nonlinear_vectors(const TetMesh& mesh, const MaterialField& material, int derivatives,
                       const SparseMatrix& K, const SparseMatrix& mass, ShiftedCholesky& factor,
                       const MatX& rigid, const MatX& modes, const VecX& omega2, int vibration) {
  const MatX basis = side_by_side(rigid, modes);
  MatX strains = uniform_strains(mesh.nodes);
  remove(basis, mass, strains);
  strains = principal_components(strains, mass, 6);

  const StaticSolver solver(K, mass, factor, basis);
  MatX x = weighted_derivatives(mesh, material, solver, modes, omega2, vibration);
  const MatX known = side_by_side(basis, strains);
  remove(known, mass, x);
  x = principal_components(x, mass, derivatives);
  remove(known, mass, x);

  MatX result = rayleigh_ritz(side_by_side(strains, x), K, mass);
  remove(basis, mass, result);
  canonicalise_signs(result);
  return result;
}

}  // namespace archetide
