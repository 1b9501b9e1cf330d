#pragma once

#include "precompute/modal/elasticity.h"

namespace archetide {

/// Takes the solver's freedom out of the modes, so that equal input gives equal modes.
///
/// Modes whose eigenvalues are equal to round-off (relative gap below kEqualEigenvalues: symmetric
/// meshes) are rotated among each other so that each is the projection of one reference field onto
/// what the modes before it left of their space. The reference fields are e_x, e_y, e_z times the
/// monomials of degree 0 to 4 in the coordinates, in this order; the first one is taken that keeps
/// at least half of the largest remaining projection, so that the choice between equivalent axes
/// does not depend on round-off. Then every sign is that of a positive largest component. Modes
/// that only nearly coincide (unstructured meshes) are fixed by the mesh and stay. `omega2`: r,
/// ascending; `modes`: 3n x r, M-orthonormal; `nodes` relative to the centre of mass.
void canonicalise(const std::vector<Vec3>& nodes, const SparseMatrix& mass, const VecX& omega2,
                  MatX& modes);

/// The sign of each column: its largest |component| becomes positive.
void canonicalise_signs(MatX& modes);

/// Relative gap in omega^2 below which the eigensolver mixes vectors at random.
inline constexpr double kEqualEigenvalues = 1e-9;

}  // namespace archetide
