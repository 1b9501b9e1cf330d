#pragma once

#include <vector>

#include "common/archetype/archetype.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// Integrals of rest shape and modes over the mass [Sha05], O(n r^2). `nodes`: n, relative to the
/// centre of mass, m; `mass`: n x n, kg, consistent or lumped; `modes`: 3n x r (r may be 0).
MomentumIntegrals momentum_integrals(const std::vector<Vec3>& nodes, const SparseMatrix& mass,
                                     const MatX& modes);

}  // namespace archetide
