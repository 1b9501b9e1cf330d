#pragma once

#include "common/mesh/tet_mesh.h"
#include "common/mesh/tri_mesh.h"
#include "precompute/meshing/quadratic_tets.h"
#include "precompute/meshing/quality.h"

namespace archetide {

enum class Mesher { kCgal, kGmsh };

struct TetrahedralizeOptions {
  Mesher mesher = Mesher::kCgal;
  int target = 10'000;             // wanted number of tets, 100 .. 5e6
  int order = 1;                   // 2: quadratic tets, the boundary's curved to the surface
  double target_tolerance = 0.15;  // relative miss of the target that triggers one correction
  unsigned seed = 1;               // of the mesher's random generator
  /// CPU seconds for all attempts together (in a body file: and for checking, repairing and cutting
  /// the surface before), and 2e-4 for each tet; then it is refused. A million tets take a tenth.
  double cpu_seconds = 40.0;
  QualityLimits limits;
};

struct TetrahedralizeResult {
  TetMesh mesh;                   // in the coordinates of the input surface
  TetQuality quality;             // passed options.limits
  double edge = 0.0;              // edge length of the last attempt, m
  int attempts = 0;               // 1 or 2
  double raw_volume_error = 0.0;  // relative, before the boundary was moved to restore the volume
  CurveReport curved;             // order 2
};

/// Fills a closed, manifold, outward oriented surface without self-intersections (the caller has
/// checked; an open one would crash the mesher, so it is refused here again). Same input, same
/// output (gmsh: in a fresh process). Throws InputError (surface unfit), NumericsError (quality
/// gate, out of time).
TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeOptions& options);

}  // namespace archetide
