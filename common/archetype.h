#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/grid_sdf.h"
#include "common/tet_mesh.h"
#include "common/tri_mesh.h"
#include "common/types.h"

namespace archetide {

/// Integrals of the rest shape x and the modes phi_i over the mass of the body, in the body frame
/// whose origin is the centre of mass. "sum m" is the mass-weighted double sum of the consistent
/// (or lumped) mass matrix. They reproduce inertia, momenta, kinetic energy and fictitious forces
/// exactly at any q, so a body step never touches the mesh (formulas in
/// runtime/solid/reduced_body.h).
struct MomentumIntegrals {
  double mass = 0.0;        // kg
  Mat3 Sxx = Mat3::Zero();  // sum m x x^T, kg m^2
  std::vector<Vec3> I3;     // r: sum m phi_i, kg (zero to round-off once re-projected)
  std::vector<Mat3> A;      // r: sum m x phi_i^T, kg m
  std::vector<Mat3> B;      // r*r, B[i*r+j] = sum m phi_i phi_j^T, kg
};

/// Precomputed description of one deformable shape, shared (const) by all its instances. SI units;
/// rest frame: origin at the centre of mass, axes of the input mesh. n nodes, nt tets, ns surface
/// vertices, nf surface triangles, r elastic modes.
struct Archetype {
  static constexpr int kFormatVersion = 1;

  // Provenance.
  std::string name;
  std::string generator;     // program and version
  std::string recipe;        // the text of the body file
  std::string mesh_file;     // as named in the recipe
  std::string mesh_hash;     // SHA-256 of the mesh file, hex
  std::string mesher;        // cgal | gmsh | input
  std::string mass_kind;     // consistent | lumped
  std::string blas;          // the BLAS that the eigensolver used
  std::string content_hash;  // SHA-256 over all stored arrays, hex; checked on reading

  // Material (SI) and Rayleigh damping C = alpha M + beta K.
  double density = 0.0, young = 0.0, poisson = 0.0;  // kg/m^3, Pa, 1
  double alpha = 0.0, beta = 0.0;                    // 1/s, s

  // Geometry in the rest frame.
  TetMesh tets;                       // n, nt (empty when read with Part::kRuntime)
  TriMesh surface;                    // ns, nf: boundary of the tets, outward
  std::vector<int> surface_to_node;   // ns
  std::vector<Vec3> surface_normals;  // ns, unit, outward
  std::vector<double> surface_areas;  // ns, m^2
  GridSdf sdf;                        // of the rest surface
  double volume = 0.0;                // of the tets, m^3
  Vec3 centre = Vec3::Zero();         // rest-frame origin in the coordinates of the input mesh, m

  // Modes: K phi = omega^2 M phi, phi^T M phi = 1 kg (so M_r = 1 kg * identity up to round-off).
  VecX omega2;         // r, 1/s^2, ascending, rigid modes removed
  VecX residuals;      // r, |K phi - omega^2 M phi| / |K phi|
  MatX surface_modes;  // 3 ns x r, m per unit q; row 3 v + axis
  MatX node_modes;     // 3 n x r (empty when read with Part::kRuntime)
  MatX M_r, K_r;       // r x r, reduced mass (kg) and stiffness (N/m)
  MomentumIntegrals integrals;

  // Quality of the tets: worst minimum dihedral angle (degrees) and radius ratio (1 = regular).
  double min_dihedral = 0.0, min_radius_ratio = 0.0;

  int r() const { return static_cast<int>(omega2.size()); }
};

enum class Part { kRuntime, kAll };

/// Throws AssertionError with the field's name if sizes or values are inconsistent (NaN, wrong
/// shape).
void validate(const Archetype& a);

/// Writes atomically (X.part, sync, rename) and byte-reproducibly; returns the content hash. Throws
/// MachineError.
std::string write_archetype(const std::string& path, const Archetype& a);

/// Throws FileError: missing, not HDF5, not ours, other version, truncated, hash mismatch.
/// `kRuntime` leaves out tets and node modes (and then the hash covers what the file stores,
/// checked by section).
Archetype read_archetype(const std::string& path, Part part = Part::kAll);

}  // namespace archetide
