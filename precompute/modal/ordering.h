#pragma once

#include <vector>

#include "precompute/modal/elasticity.h"

namespace archetide {

/// Fill-reducing order of the 3n dofs by nested dissection of the n nodes (METIS [KK98]): position
/// -> dof. Always nested dissection [D11].
std::vector<int> nested_dissection(const SparseMatrix& stiffness);

/// K + s M on K's pattern; `mass` is scalar n x n with a pattern inside K's.
SparseMatrix shifted(const SparseMatrix& stiffness, const SparseMatrix& mass, double s);

}  // namespace archetide
