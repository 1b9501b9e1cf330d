#pragma once

#include "common/base/types.h"

namespace archetide {

/// Impulses lambda >= 0 with A lambda >= b and lambda_k (A lambda - b)_k = 0, m: the least pushes
/// that give every point at least the speed b. A (m x m) is symmetric and positive semi-definite.
/// Active set of [LH74], chapter 23: exact after finitely many exchanges, and it never
/// keeps two points whose rows are dependent. Speeds within 1e-12 of the largest |b| count as
/// reached.
VecX nonnegative_least_squares(const MatX& A, const VecX& b);

}  // namespace archetide
