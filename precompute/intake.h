#pragma once

#include <string>
#include <vector>

#include "precompute/surface_io.h"

namespace archetide {

/// What intake found and changed; lengths in m, after scaling.
struct IntakeReport {
  int vertices = 0, faces = 0;      // of the accepted surface
  int welded = 0;                   // vertices that repeated an earlier one exactly
  int unused = 0;                   // vertices without a face, dropped
  int collapsed = 0;                // triangles with a repeated corner, dropped
  int reoriented = 0;               // triangles turned round to agree with their neighbours
  bool turned_inside_out = false;   // the whole surface faced inward
  double volume = 0.0, area = 0.0;  // m^3, m^2
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // bounding box
  /// One line for each change, for the log.
  std::vector<std::string> notes() const;
};

/// Turns a surface file into a closed, manifold, outward oriented single shell without
/// self-intersections, multiplied by `scale`. Only changes that keep the shape are made (and
/// reported); anything else is an InputError that names the defect, how many there are, and the
/// faces and places (file coordinates) of the first ones.
TriMesh accept_surface(const SurfaceFile& file, double scale, IntakeReport& report);

/// Pairs of triangles that intersect other than in a shared edge or vertex. The mesh must be
/// manifold.
std::vector<std::pair<int, int>> self_intersections(const TriMesh& mesh);

}  // namespace archetide
