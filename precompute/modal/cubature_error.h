#pragma once

#include "common/archetype/elastic_cubature.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// How far deflections of a body are from those that all its tets give in the same basis, relative.
struct DeflectionError {
  double mean = 0.0, worst = 0.0;
};

/// Under tractions on random patches of the boundary that would deflect a linear body by 10 to 30 %
/// of its diagonal. `basis`: 3n x r, its stiffness `K_r` (r x r). The same input gives the same loads.
DeflectionError deflection_error(const TetMesh& mesh, const MaterialField& material,
                                 const MatX& basis, const MatX& K_r, const ElasticCubature& V);

}  // namespace archetide
