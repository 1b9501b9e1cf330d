#pragma once

#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// A triangle list without repeated vertices, collapsed triangles and unused vertices.
struct Weld {
  TriMesh mesh;
  std::vector<int> kept;  // nf: which input triangle each one was
  int welded = 0;         // vertices that repeated an earlier one
  int unused = 0;         // vertices without a face, dropped
  int collapsed = 0;      // triangles with a repeated corner, dropped
};

/// Makes vertex v the same as `same_as[v]` (same_as[same_as[v]] = same_as[v]).
Weld merge_vertices(const TriMesh& mesh, const std::vector<int>& same_as);

/// Makes vertices with exactly equal coordinates one (-0 is 0).
Weld weld(const TriMesh& mesh);

}  // namespace archetide
