#pragma once

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Volume and first moment of what a closed, outward oriented surface encloses, and how they change
/// with its n vertices.
struct EnclosedMoments {
  double volume = 0.0;        // V, m^3
  Vec3 first = Vec3::Zero();  // integral of x over it, m^4
  // 3 n x 4, row 3 v + axis: dV, m^2, and the three of d first, m^3, per displacement of a vertex
  Eigen::Matrix<double, Eigen::Dynamic, 4, Eigen::RowMajor> rates{};
};

/// Of the surface with its vertices displaced by u, 3 n, m. O(nf + n).
EnclosedMoments displaced_moments(const TriMesh& surface, const VecX& u);

}  // namespace archetide
