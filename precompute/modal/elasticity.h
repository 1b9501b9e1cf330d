#pragma once

#include <Eigen/SparseCore>

#include "common/mesh/tet_mesh.h"
#include "precompute/base/material.h"

namespace archetide {

using SparseMatrix =
    Eigen::SparseMatrix<double>;  // column major; symmetric ones store both triangles

enum class MassKind { kConsistent, kLumped };

/// Stiffness of linear or quadratic tets, 3n x 3n, N/m; dof 3 node + axis. Exact on straight tets,
/// a rule of degree 5 on curved ones. Throws InputError for an unphysical material.
SparseMatrix stiffness_matrix(const TetMesh& mesh, const MaterialField& material);

/// Mass, n x n, kg: acts on each axis alike; exact on curved tets too. Lumped is diagonal (a
/// quarter of each tet to its nodes) and for linear tets only: its error has the sign opposite to
/// the stiffness's and nearly cancels it, while no lumping of quadratic tets keeps their order.
SparseMatrix mass_matrix(const TetMesh& mesh, const MaterialField& material, MassKind kind);

/// y = (M x 1_3) x for 3n-vectors (or blocks of columns) with the scalar n x n mass.
MatX apply_mass(const SparseMatrix& mass, const MatX& x);

/// Shifts the nodes so that the centre of mass is the origin; returns the old centre.
Vec3 move_to_centre_of_mass(TetMesh& mesh, const MaterialField& material = Material{1.0, 1.0, 0.0});

}  // namespace archetide
