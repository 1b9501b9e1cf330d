#pragma once

#include "common/archetype/tet_matrices.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// Mass and stiffness of the tets for bodies whose nodes are degrees of freedom at run time, with an
/// order of elimination by nested dissection. Mass as the modes have it. `nonlinear`: with what
/// NeoHookean material of every tet needs.
TetMatrices keep_matrices(const TetMesh& mesh, const MaterialField& material, MassKind mass,
                          bool nonlinear = false);

}  // namespace archetide
