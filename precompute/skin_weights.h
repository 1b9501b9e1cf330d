#pragma once

#include "common/archetype/skin.h"

namespace archetide {

/// Weights of a skin from the part (0 .. parts - 1) that owns each vertex: the owners' indicator
/// functions, smoothed along the surface by the screened Poisson equation
///     (M + h^2 L) w = M chi     (M: vertex areas, L: cotangents, negative ones left out),
/// whose solutions are >= 0 and sum to 1; then steepened so that a hand-over between two parts ends
/// within `blend` (m), at most Skin::kMostParts of a vertex kept, and divided by their sum. Fills
/// part_of and weights.
void find_skin_weights(const std::vector<int>& owner, double blend, Skin& skin);

}  // namespace archetide
