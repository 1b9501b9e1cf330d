#pragma once

#include "common/types.h"

namespace archetide {

/// Generalised inverse mass of a body (or group) that must satisfy C y = 0, formulation section 5:
///     H_c^-1 = H^-1 - H^-1 C^T (C H^-1 C^T)^+ C H^-1 ,
/// symmetric positive semi-definite. Redundant rows of C are ordinary: the pseudo-inverse cuts the
/// eigenvalues below 1e-10 of the largest.
struct ConstrainedInverse {
  MatX inverse_mass;  // n x n
  MatX correction;    // n x m: H^-1 C^T (C H^-1 C^T)^+
  MatX rows;          // m x n, C

  /// y with the forbidden motion taken out: the nearest admissible velocity in the metric of H.
  VecX project(const VecX& y) const { return y - correction * (rows * y); }
};
ConstrainedInverse constrain(const MatX& inverse_mass, const MatX& rows);

/// Impulses (m) by which the rows take the motion C y out of y; positive pushes along the row.
VecX constraint_impulses(const MatX& inverse_mass, const MatX& rows, const VecX& y);

/// Drops the rows that would have to pull to hold the velocity `without` (the one that the body has when
/// nothing holds it). Returns whether any was dropped.
bool release_pulling_rows(const MatX& inverse_mass, const VecX& without, MatX& rows);

}  // namespace archetide
