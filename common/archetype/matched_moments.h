#pragma once

#include "common/archetype/archetype.h"

namespace archetide {

/// The symmetric Sigma with Sigma S Sigma = wanted: nodes at Sigma x have the second moments `wanted`
/// where nodes at x have S (both symmetric and positive definite, kg m^2). docs/method.md, P6a.
Mat3 matching_stretch(const Mat3& S, const Mat3& wanted);

/// Integrals over a mass whose inertia is not exact become those of nodes at Sigma x with the second
/// moments Sxx (kg m^2), and of modes without the rotation of these that gives them angular momentum
/// (P6b): sums over fields as before, so that kinetic energy stays a sum of squares.
void match_moments(const Mat3& Sxx, MomentumIntegrals& integrals);

}  // namespace archetide
