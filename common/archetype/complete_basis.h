#pragma once

#include "common/archetype/archetype.h"

namespace archetide {

/// Elastic motions of a free mesh of n nodes: every degree of freedom but the six rigid ones.
inline int elastic_dofs(int n) { return 3 * n - 6; }

/// Whether the modes span every motion of the tet mesh: with them all a body is the full finite
/// element model. False when the tets were not read (Part::kRuntime).
inline bool has_complete_basis(const Archetype& a) {
  return a.clamped.empty() && !a.tets.nodes.empty() &&
         a.r() == elastic_dofs(static_cast<int>(a.tets.nodes.size()));
}

}  // namespace archetide
