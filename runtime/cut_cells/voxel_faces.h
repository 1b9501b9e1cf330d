#pragma once

#include <vector>

#include "runtime/cut_cells/body_flux.h"
#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// Eq. 41, the voxel geometry of the paper, of one body: a face is a constraint face when exactly
/// one of its cells has its centre inside the body; the velocity there is that of the nearest
/// surface point (J of Section 5.3).
struct ConstraintFace {
  int axis;
  Vec3i face;    // index of the MAC face
  Vec3i outer;   // its cell outside the body
  double sign;   // +1 if the outer cell lies on the high side of the face
  int triangle;  // nearest point of the surface
  Vec3 bary;
  VecX Q;  // 6 + r, face-normal velocity per unit y; a body of nodes: empty
};

struct VoxelBody {
  std::vector<Vec3i> inside;  // cells whose centre is inside the body
  std::vector<ConstraintFace> faces;
};

/// Cells of the grid whose centre is inside the closed surface (winding number by vertical rays).
std::vector<Vec3i> cells_inside(const Grid& g, const std::vector<Vec3>& points,
                                const std::vector<Vec3i>& triangles);

/// Finds constraint faces, marks `inside` cells and closes their faces in `fractions`.
VoxelBody voxel_body(const Grid& g, const BodySurface& surface, SolidFractions& fractions);

/// Voxel obstacle: closes the faces of all inside cells.
void add_voxel_fractions(const std::vector<Vec3i>& inside, SolidFractions& fractions);

/// F = G^T W^T Q on the faces whose outer cell satisfies `is_water`, and the dual-cell fluid mass
/// Q^T b Q (b = rho dx^3) and momentum Q^T b u* that the paper lets the body carry.
struct VoxelCoupling {
  BodyFlux flux;
  MatX fluid_mass;      // (6 + r) x (6 + r), kg
  VecX fluid_momentum;  // 6 + r
};
VoxelCoupling voxel_coupling(const Grid& g, const VoxelBody& body, int dofs, double density,
                             const MacField& u_star, const Array3<CellKind>& kind);

/// The same of a body of nodes, whose fluid mass is Q b Q^T with a column for each wet face.
struct NodalVoxelCoupling {
  BodyFlux flux;
  MatX Q;          // (6 + 3 n) x faces
  VecX momentum;   // b u*, per face, kg m/s
  double b = 0.0;  // kg
};
NodalVoxelCoupling nodal_voxel_coupling(const Grid& g, const VoxelBody& body,
                                        const BodySurface& surface, double density,
                                        const MacField& u_star, const Array3<CellKind>& kind);
/// Velocity along its axis of the point of a constraint face; of the surface's vertices, 3 ns.
double face_speed(const ConstraintFace& f, const BodySurface& surface, const VecX& velocities);

}  // namespace archetide
