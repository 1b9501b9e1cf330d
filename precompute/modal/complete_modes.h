#pragma once

#include "precompute/modal/eigen_solver.h"

namespace archetide {

/// Most modes of a complete basis: the integrals take 9 numbers for each pair of modes (160 MB), a
/// step of a body the Cholesky factor of a dense matrix of that size.
inline constexpr int kMostCompleteModes = 1500;

/// Every elastic eigenpair of K phi = lambda M phi by a dense solver: all 3n - 6 that are
/// M-orthogonal to the six rigid motions (3n x 6, M-orthonormal). `mass`: scalar n x n. Throws
/// InputError beyond kMostCompleteModes, MachineError when there is not enough memory,
/// NumericsError.
EigenResult every_eigenpair(const SparseMatrix& stiffness, const SparseMatrix& mass,
                            const MatX& rigid);

}  // namespace archetide
