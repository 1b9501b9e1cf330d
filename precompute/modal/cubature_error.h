#pragma once

#include "common/archetype/elastic_cubature.h"
#include "precompute/modal/elasticity.h"
#include "precompute/modal/patch_loads.h"

namespace archetide {

/// How far deflections of a nonlinear body are from those that all its tets give in the same basis,
/// under patch_loads that would deflect a linear body by 10 to 30 % of its diagonal. `basis`: 3n x r,
/// its stiffness `K_r` (r x r).
DeflectionError cubature_error(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const MatX& K_r, const ElasticCubature& V);

}  // namespace archetide
