#pragma once

#include "common/archetype/tet_elasticity.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// Lame's constants of every tet, nt, Pa.
struct LameField {
  VecX lambda, mu;
};
LameField lame_of_tets(const MaterialField& material, std::size_t tets);

/// Internal nodal forces (3n, N) of the displacement u (3n, m) for NeoHookean material, with four
/// points in a quadratic tet and one in a linear one: dV/du.
VecX internal_force(const TetMesh& mesh, const MaterialField& material, const VecX& u);

/// Elastic energy of u, J, and the smallest det F at the same points.
struct ElasticState {
  double energy = 0.0, least_volume = 1.0;
};
ElasticState elastic_state(const TetMesh& mesh, const MaterialField& material, const VecX& u);

/// The force of second order at rest, D^2 f(0)[u, v] (3n, N), symmetric in u and v: what the
/// stiffness changes by along u, applied to v.
VecX second_order_force(const TetMesh& mesh, const MaterialField& material, const VecX& u,
                        const VecX& v);

using MaterialPoint = TetElasticity::Point;
/// All of them, tet after tet.
std::vector<MaterialPoint> material_points(const TetMesh& mesh);
/// The energy of the `basis` (3n x r) at some of them, each with its own weight times `scale`.
ElasticCubature sampled_energy(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const std::vector<MaterialPoint>& points,
                               const VecX& scale);

}  // namespace archetide
