#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/archetype/elastic_cubature.h"
#include "common/archetype/linear_shape.h"
#include "common/archetype/surface_rung.h"
#include "common/archetype/tet_matrices.h"
#include "common/base/types.h"
#include "common/mesh/grid_sdf.h"
#include "common/mesh/tet_mesh.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Integrals of the rest shape x and the modes phi_i over the mass of the body, in the body frame
/// whose origin is the centre of mass. "sum m" is the mass-weighted double sum of the consistent
/// (or lumped) mass matrix. They reproduce inertia, momenta, kinetic energy and fictitious forces
/// exactly at any q, so a step of a body never reads the mesh (docs/method.md, P6 and S1;
/// runtime/solid/configuration_terms.cpp).
struct MomentumIntegrals {
  double mass = 0.0;        // kg
  Mat3 Sxx = Mat3::Zero();  // sum m x x^T, kg m^2
  std::vector<Vec3> I3;     // r: sum m phi_i, kg (zero to round-off once re-projected)
  std::vector<Mat3> A;      // r: sum m x phi_i^T, kg m
  std::vector<Mat3> B;      // r*r, B[i*r+j] = sum m phi_i phi_j^T, kg
};

/// Vertices of the rest surface under a name, for loads, actuation and joints.
struct PointSet {
  std::string name;
  std::vector<int> vertices;  // ascending
};

/// A named point with three axes (columns, orthonormal) in the rest frame, for joints.
struct JointFrame {
  std::string name;
  Vec3 point = Vec3::Zero();     // m
  Mat3 axes = Mat3::Identity();  // 1
};

/// Precomputed description of one deformable shape, shared (const) by all its instances. SI units;
/// rest frame: origin at the centre of mass, axes of the input mesh. n nodes, nt tets, ns surface
/// vertices, nf surface triangles, r elastic modes.
struct Archetype {
  static constexpr int kFormatVersion = 2;             // of linear bodies
  static constexpr int kNonlinearFormatVersion = 3;    // the same and an elastic energy
  static constexpr int kMatricesVersion = 1;           // of the optional part with `matrices`, ..
  static constexpr int kNonlinearMatricesVersion = 2;  // .. with the material of the tets

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

  std::string clamped;  // point set that the modes were computed with held still; "" = free

  // Material (SI) and Rayleigh damping C = alpha M + beta K. Several materials: density is the mean
  // (mass / volume), young and poisson those of the first.
  double density = 0.0, young = 0.0, poisson = 0.0;  // kg/m^3, Pa, 1
  double alpha = 0.0, beta = 0.0;                    // 1/s, s

  // Geometry in the rest frame.
  TetMesh tets;                       // n, nt (empty when read with Part::kRuntime)
  TriMesh surface;                    // ns, nf: boundary, outward, with the tets' volume and centre
  std::vector<int> surface_to_node;   // ns
  std::vector<Vec3> surface_normals;  // ns, unit, outward
  std::vector<double> surface_areas;  // ns, m^2
  GridSdf sdf;                        // of the rest surface
  std::vector<PointSet> point_sets;
  std::vector<JointFrame> joint_frames;
  double volume = 0.0;         // of the tets, m^3
  Vec3 centre = Vec3::Zero();  // rest-frame origin in the coordinates of the input mesh, m

  // Modes: K phi = omega^2 M phi, phi^T M phi = 1 kg (so M_r = 1 kg * identity up to round-off).
  // Static response vectors stand behind the vibration modes: M-orthonormal to all others, K_r
  // diagonal, omega2 their Rayleigh quotient; they solve no eigenproblem.
  VecX omega2;                 // r, 1/s^2, ascending, rigid modes removed
  VecX residuals;              // r, |K phi - omega^2 M phi| / |K phi|
  std::vector<int> is_static;  // r, 1: a static response vector, 0: a vibration mode
  VecX frequency_error;        // estimated relative error of each vibration mode's frequency
                               // (mesh refinement; positive: too high), or empty: not estimated
  MatX surface_modes;          // 3 ns x r, m per unit q; row 3 v + axis
  std::vector<SurfaceRung> ladder;  // coarser surfaces for the water, finest first; may be empty
  LinearShape linear;               // linear_shape() of these; derived, not stored
  MatX node_modes;                  // 3 n x r (empty when read with Part::kRuntime)
  TetMatrices matrices;  // kept on request (keep = "tets"); empty when read with Part::kRuntime
  MatX M_r, K_r;         // r x r, reduced mass (kg) and stiffness (N/m)
  MomentumIntegrals integrals;
  ElasticCubature elastic;  // nonlinear bodies: the energy whose stiffness at rest is about K_r;
                            // empty: linear, q^T K_r q / 2

  // Quality of the tets: worst minimum dihedral angle (degrees) and radius ratio (1 = regular).
  double min_dihedral = 0.0, min_radius_ratio = 0.0;

  bool nonlinear() const { return !elastic.empty(); }
  int r() const { return static_cast<int>(omega2.size()); }
};

enum class Part { kRuntime, kAll };

/// Throws AssertionError with the field's name if sizes or values are inconsistent (NaN, wrong
/// shape).
void validate(const Archetype& a);

/// Writes atomically (X.part, sync, rename) and byte-reproducibly; returns the content hash. Throws
/// MachineError.
std::string write_archetype(const std::string& path, const Archetype& a);

/// What the shape correction of each surface needs, from these [D81].
void derive_shapes(Archetype& a);

/// Throws FileError: missing, not HDF5, not ours, other version, truncated, hash mismatch.
/// `kRuntime` leaves out tets, node modes and their matrices (and then the hash covers what the file
/// stores, checked by section). The content hash does not count the matrices, which follow from the
/// rest; they have one of their own.
Archetype read_archetype(const std::string& path, Part part = Part::kAll);

}  // namespace archetide
