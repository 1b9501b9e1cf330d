#pragma once

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// What the linear strain tells of the volume V that a surface encloses and of its centroid c, to the
/// first order of the displacements of its vertices or of the amplitudes of modes (P7).
struct LinearShape {
  double volume = 0.0;           // V(0), m^3; 0: not known
  Vec3 centroid = Vec3::Zero();  // c(0), m
  MatX rates = MatX();           // x 4: d ln V and dc (m), per unit

  bool empty() const { return volume == 0.0; }
};

/// Of displacements, 3 n x 4.
LinearShape linear_shape(const TriMesh& surface);
/// Of modes, r x 4. `modes`: 3 n x r, row 3 v + axis.
LinearShape linear_shape(const TriMesh& surface, const MatX& modes);

}  // namespace archetide
