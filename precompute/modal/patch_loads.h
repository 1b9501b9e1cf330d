#pragma once

#include "common/base/types.h"
#include "common/mesh/tet_mesh.h"

namespace archetide {

/// How far deflections of a reduced body are from better ones, largest difference over largest
/// displacement: over some loads, in the mean and at most.
struct DeflectionError {
  double mean = 0.0, worst = 0.0;

  /// Deflections (3n) under one of `loads` loads.
  void add(const VecX& deflection, const VecX& better, Eigen::Index loads);
};

/// Loads that a body was not reduced for: nodal forces (3n x 12) of uniform tractions in random
/// directions on patches of the boundary, whose radii are 12 and 25 % of the diagonal by turns, of
/// any size. The same mesh gives the same loads.
MatX patch_loads(const TetMesh& mesh);

}  // namespace archetide
