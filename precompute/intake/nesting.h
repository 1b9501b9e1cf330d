#pragma once

#include <vector>

#include "common/mesh/surface_topology.h"

namespace archetide {

/// The closed shells of a surface and which lies in which. Shells that cross each other count as
/// lying beside each other.
struct Nesting {
  std::vector<int> shell;      // nf: of each triangle
  std::vector<TriMesh> parts;  // each shell by itself
  std::vector<double> volume;  // enclosed by each, negative when it faces inward
  std::vector<int> parent;     // the smallest shell around it, -1: none
  std::vector<int> depth;      // shells around it

  int count() const { return static_cast<int>(parts.size()); }
  /// 1: it bounds a solid, -1: a cavity, both seen from the outermost shell around it, which counts
  /// as facing outward.
  int sense(int s) const;
  /// Turned round so that it faces out of the solid.
  TriMesh facing_outward(int s) const;
};

/// `crossing`: pairs of triangles that intersect.
Nesting nest_shells(const TriMesh& mesh, const std::vector<SurfaceEdge>& edges,
                    const std::vector<std::pair<int, int>>& crossing);

/// Triangles with the other orientation.
void turn_round(TriMesh& mesh);

}  // namespace archetide
