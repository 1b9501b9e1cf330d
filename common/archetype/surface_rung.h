#pragma once

#include <algorithm>
#include <vector>

#include "common/archetype/linear_shape.h"
#include "common/archetype/swelling.h"
#include "common/base/types.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// A coarser surface of a body, for water whose cells are large against the triangles of the body's
/// own surface. It encloses the same volume about the same centroid (docs/method.md, P8).
struct SurfaceRung {
  static constexpr int kVersion = 1;  // of the optional part of a file with the ladder
  TriMesh surface;         // n, nf: closed, outward, in the frame of the body's own surface, m
  MatX modes = MatX();     // 3 n x r, m per unit q; row 3 v + axis
  double deviation = 0.0;  // m, root mean square of its distance from the body's own surface
  // Derived, not stored:
  LinearShape linear = {};  // of these modes on this surface
  Swelling swelling = {};   // of nonlinear modes, what is more than on the body's own surface [D81]
};

/// Mean length of the edges, were the triangles equilateral, m.
double mean_edge(const TriMesh& surface);

/// Twice the volume over the area: the thickness of a plate, m.
double mean_thickness(const TriMesh& surface);

/// The coarsest of a ladder (finest first) that water of cells of dx (m) meets as it would meet the
/// body's own surface, or null: none is as good. A rung serves if its edges are at most kEdge cells
/// and its deviation is at most kDeviation of a cell and of the body's thickness.
template <class Rung>
const Rung* coarsest_rung(const std::vector<Rung>& ladder, double dx) {
  constexpr double kEdge = 1.5, kDeviation = 0.01;
  const Rung* chosen = nullptr;
  for (const Rung& rung : ladder)
    if (mean_edge(rung.surface) <= kEdge * dx &&
        rung.deviation <= kDeviation * std::min(dx, mean_thickness(rung.surface)))
      chosen = &rung;
  return chosen;
}

}  // namespace archetide
