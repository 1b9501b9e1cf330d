#pragma once

#include <memory>

#include "common/archetype/archetype.h"

namespace archetide {

/// Closed, outward surfaces around the origin.
TriMesh icosphere(int subdivisions, double radius);          // 20 * 4^subdivisions triangles
TriMesh box_surface(const Vec3& lengths, int subdivisions);  // 2^subdivisions cells along each edge
TriMesh torus_surface(double R, double r, int nu, int nv);   // axis z, 2 nu nv triangles

/// A rigid archetype (r = 0): the solid inside a closed surface, recentred at its centre of mass,
/// with the polyhedron's exact mass and second moments. Young's modulus 1 MPa, no damping.
std::shared_ptr<const Archetype> rigid_surface_archetype(const TriMesh& surface, double density);

/// Rest shapes of the deformable archetypes, recentred at their volume's centroid.
TetMesh box_tets(const Vec3& lengths, const Vec3i& cells);       // 6 tets a cell
TetMesh torus_tets(double R, double r, int around, int across);  // 6 tets a cell of a square tube
TetMesh blob_tets(unsigned seed, const Vec3& lengths,
                  const Vec3i& cells);  // box with nodes moved at random

/// A deformable archetype and what a dense oracle needs beside it. archetype->node_modes is 3 n x
/// r.
struct SyntheticBody {
  std::shared_ptr<Archetype> archetype;
  MatX scalar_mass;  // n x n consistent mass matrix; the full one is this times the 3 x 3 identity,
                     // kg

  const std::vector<Vec3>& nodes() const { return archetype->tets.nodes; }
};

struct SyntheticOptions {
  unsigned seed = 1;
  int r = 4;
  double density = 1000.0;         // kg/m^3
  double first_omega = 10.0;       // rad/s; omega_i = first_omega (1 + 0.4 i)
  double alpha = 0.0, beta = 0.0;  // Rayleigh damping, 1/s and s
};

/// Smooth random modes (polynomials of degree 2 in the coordinates), orthonormal in the consistent
/// mass to each other and orthogonal to the rigid motions: M_r = 1 kg identity, K_r =
/// diag(omega^2). Integrals by direct double sums.
SyntheticBody deformable_archetype(const TetMesh& tets, const SyntheticOptions& options);

/// The same with given shapes (3 n x r node fields; rigid motions are taken out and they are made
/// orthonormal in the mass in their order) and frequencies, rad/s.
SyntheticBody deformable_archetype(const TetMesh& tets, double density, const MatX& shapes,
                                   const VecX& omega);

/// Without the correction of its shape: what oracles know that draw the linear modes as they are.
SyntheticBody linear_alone(SyntheticBody body);

/// The blob used where any valid deformable body will do: 4 x 3 x 3 cells of 0.5 x 0.4 x 0.3 m.
SyntheticBody random_archetype(unsigned seed, int r);

}  // namespace archetide
