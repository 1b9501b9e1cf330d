#pragma once

#include "common/base/types.h"

namespace archetide {

/// Weights x >= 0 (n) with few entries above 0 and A x ~ b (A: m x n), by the active set of [LH74]:
/// the column that helps most joins, columns whose weight would become negative leave. Ends at
/// |A x - b| <= tolerance |b| or with `most` columns.
VecX sparse_nonnegative_fit(const MatX& A, const VecX& b, double tolerance, Eigen::Index most);

}  // namespace archetide
