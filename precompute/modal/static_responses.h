#pragma once

#include <vector>

#include "precompute/modal/boundary_quadrature.h"
#include "precompute/modal/elasticity.h"
#include "precompute/modal/shifted_cholesky.h"

namespace archetide {

/// Which static responses join the modes (residual-flexibility vectors).
struct StaticLoads {
  /// For each kept mode the surface pressure p = n . phi of its own normal displacement: the load
  /// of the added mass, which is what surrounding water does to a vibrating body first of all.
  bool pressure = false;
  /// Surface pressures p = x, y and z: weight carried by hydrostatic pressure, in any attitude.
  bool gravity = false;
  /// Unit forces along x, y and z spread evenly over each of these lists of nodes.
  std::vector<std::vector<int>> nodes;

  bool any() const { return pressure || gravity || !nodes.empty(); }
};

/// What a basis of rigid motions (3n x 6) and modes (3n x r) lacks to answer the loads statically:
/// X = K^+ (f - M Phi Phi^T f), Phi = [rigid, modes], so rigid motions relieve the load's resultant
/// and the modes' own part is left out. Loads with almost no response (a torsional mode has no
/// normal displacement) and dependent responses are dropped. The rest is made M-orthonormal and
/// turned so that X^T K X is diagonal and ascending (Rayleigh-Ritz). Columns: 3n x s, s >= 0,
/// orthogonal in M and K to the basis. `factor`: of K - sigma M, sigma < 0. Throws NumericsError.
MatX static_responses(const TetMesh& mesh, const StaticLoads& loads, const SparseMatrix& K,
                      const SparseMatrix& mass, ShiftedCholesky& factor, const MatX& rigid,
                      const MatX& modes);

/// Static displacements outside of a basis (3n x k, M-orthonormal, rigid motions among it): K^+ (f -
/// M Phi Phi^T f). Keeps references.
class StaticSolver {
 public:
  /// `factor`: of K - sigma M, sigma < 0.
  StaticSolver(const SparseMatrix& K, const SparseMatrix& mass, ShiftedCholesky& factor,
               const MatX& basis);
  /// 3n. Throws NumericsError.
  VecX respond(const VecX& f) const;

 private:
  const SparseMatrix& K_;
  ShiftedCholesky& factor_;
  const MatX& basis_;
  MatX weighted_;  // M Phi
};

/// The columns of a, then those of b.
MatX side_by_side(const MatX& a, const MatX& b);

/// M-orthonormal vectors of the same space that diagonalise K, ascending; dependent directions are
/// dropped.
MatX rayleigh_ritz(const MatX& x, const SparseMatrix& K, const SparseMatrix& mass);

/// Nodal forces (3n) of a pressure (Pa, at each of the boundary's points): f_i = -integral of N_i p
/// n.
VecX pressure_load(const TetMesh& mesh, const std::vector<BoundaryPoint>& points,
                   const VecX& pressure);

}  // namespace archetide
