#pragma once

#include <vector>

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// A surface vertex of a body at a wall.
struct ContactPoint {
  int vertex = -1;
  Vec3 normal = Vec3::Zero();  // unit, from the wall into the free space
  double gap = 0.0;            // m, negative beyond the wall
};

/// Rows nᵀ J, m x (6 + r): separating speed of each point per unit generalised velocity y. The
/// first six entries of (rows^T lambda) are the linear and angular momentum that impulses lambda (N
/// s) along n give.
MatX contact_rows(const ReducedBody& body, const ConfigurationTerms& terms,
                  const std::vector<ContactPoint>& points);

/// Rows t₁ᵀ J, t₂ᵀ J of every point, 2 m x (6 + r), with t₁, t₂ an orthonormal basis of its tangent
/// plane.
MatX tangent_rows(const ReducedBody& body, const ConfigurationTerms& terms,
                  const std::vector<ContactPoint>& points);

}  // namespace archetide
