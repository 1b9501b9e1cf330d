#pragma once

#include <string>
#include <vector>

#include "common/mesh/tet_mesh.h"

namespace archetide {

/// What a tet mesh must satisfy before modes are computed on it, whichever mesher made it.
struct QualityLimits {
  double min_dihedral = 5.0;       // degrees; below, the stiffness conditioning suffers
  double min_radius_ratio = 0.05;  // 3 inradius / circumradius, 1 for a regular tet
  double max_volume_error = 0.01;  // relative, against the volume that the surface encloses
};

/// Measured quality; angles in degrees, volumes in m^3.
struct TetQuality {
  int nodes = 0, tets = 0;
  int inverted = 0;           // tets with volume <= 0
  double min_dihedral = 0.0;  // worst over all tets, degrees
  int min_dihedral_tet = -1;  // where
  double min_radius_ratio = 0.0;
  int min_radius_ratio_tet = -1;
  int nonmanifold_edges = 0;  // boundary edges without exactly two boundary triangles
  int nonmanifold_nodes = 0;  // boundary nodes at which several fans of triangles meet
  int nonmanifold_faces = 0;  // faces shared by more than two tets
  int unused_nodes = 0;
  int components = 0;      // parts connected through faces
  int shells = 0;          // parts of the boundary
  int surface_shells = 0;  // of the input surface; 0 = there was none
  double volume = 0.0;
  double surface_volume = 0.0;  // enclosed by the input surface; 0 = there was none
  double volume_error = 0.0;    // (volume - surface_volume) / surface_volume
};

/// `surface_volume` <= 0 when the tets did not come from a surface (volume_error is then 0).
TetQuality measure_quality(const TetMesh& mesh, double surface_volume, int surface_shells = 0);

/// Smallest dihedral angle (degrees) and radius ratio of every tet.
struct TetMeasure {
  double min_dihedral, radius_ratio;
};
std::vector<TetMeasure> tet_measures(const TetMesh& mesh);

/// Tets that violate a limit by their shape.
std::vector<int> bad_tets(const TetMesh& mesh, const QualityLimits& limits);

/// Every violated limit with its number, separated by "; "; empty when the mesh is good.
std::string quality_complaints(const TetQuality& quality, const QualityLimits& limits);

/// Throws TetDefects naming every violated limit with its number, and the first tets that violate
/// one with their places; `hint` says what to do.
void require_quality(const TetMesh& mesh, const TetQuality& quality, const QualityLimits& limits,
                     const std::string& mesher, const std::string& hint);

}  // namespace archetide
