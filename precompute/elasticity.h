#pragma once

#include <Eigen/SparseCore>

#include "common/tet_mesh.h"

namespace archetide {

using SparseMatrix =
    Eigen::SparseMatrix<double>;  // column major; symmetric ones store both triangles

/// Isotropic linear elastic material.
struct Material {
  double density = 0.0;  // kg/m^3, > 0
  double young = 0.0;    // Pa, > 0
  double poisson = 0.0;  // 1, in (-1, 0.5)
};

enum class MassKind { kConsistent, kLumped };

/// Stiffness of linear tets, 3n x 3n, N/m; dof 3 node + axis.
SparseMatrix stiffness_matrix(const TetMesh& mesh, const Material& material);

/// Mass, n x n, kg: acts on each axis alike. Lumped is diagonal (a quarter of each tet to its
/// nodes).
SparseMatrix mass_matrix(const TetMesh& mesh, double density, MassKind kind);

/// y = (M x 1_3) x for 3n-vectors (or blocks of columns) with the scalar n x n mass.
MatX apply_mass(const SparseMatrix& mass, const MatX& x);

/// Shifts the nodes so that the centre of mass (of uniform density) is the origin; returns the old
/// centre.
Vec3 move_to_centre_of_mass(TetMesh& mesh);

}  // namespace archetide
