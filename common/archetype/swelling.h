#pragma once

#include <array>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// What straight displacements by modes add at second order to the volume V that a surface encloses and to its
/// centroid c: ln V(q) = ln V(0) + a.q / V(0) + q^T E q + O(q^3), and, once the shape is scaled
/// about the origin so that E is undone, c_k(q) = c_k(0) + b_k.q + q^T C_k q + O(q^3). A turn by an
/// angle t drawn as straight displacements swells a body by t^2, and no strain energy resists it: E
/// and C are what undoes it. All r x r, symmetric; empty: not known.
struct Swelling {
  MatX volume;                   // E, 1
  std::array<MatX, 3> centroid;  // C, m
};

/// `modes`: 3 n x r, of the vertices, row 3 v + axis. O(nf r + n r^2).
Swelling second_order_swelling(const TriMesh& surface, const MatX& modes);

}  // namespace archetide
