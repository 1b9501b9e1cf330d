#pragma once

#include "precompute/modal/elasticity.h"
#include "precompute/modal/shifted_cholesky.h"

namespace archetide {

/// What linear modes lack to bend, twist and be squashed far: the six uniform strains, and modal
/// derivatives [IC85] [BJ05]
///     X_ij = -K^+ D^2 f(0)[phi_i, phi_j],
/// the displacement that goes with the modes i and j at second order; of all pairs the `derivatives`
/// strongest directions (principal components in the mass, weighted by omega_1^4 / (omega_i^2
/// omega_j^2)). Columns, 3n x s: orthogonal in M to `rigid` (3n x 6) and `modes` (3n x r, with
/// `omega2`), M-orthonormal and K-diagonal among each other. `vibration`: the first columns of
/// `modes` whose derivatives are taken. `factor`: of K - sigma M, sigma < 0. Throws NumericsError.
MatX nonlinear_vectors(const TetMesh& mesh, const MaterialField& material, int derivatives,
                       const SparseMatrix& K, const SparseMatrix& mass, ShiftedCholesky& factor,
                       const MatX& rigid, const MatX& modes, const VecX& omega2, int vibration);

}  // namespace archetide
