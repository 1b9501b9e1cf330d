#pragma once

#include "common/base/profile.h"
#include "precompute/recipe.h"

namespace archetide {

/// Estimates the relative error of each frequency (positive: too high) from a second solve on a
/// coarser mesh of the same surface: with omega_h = omega (1 + C h^2p), p the order of the tets,
/// the difference of the two meshes gives C (Richardson). `omega2`: the vibration modes on `tets`
/// tets. Empty when no coarser mesh passes the quality gate. Phase "estimate" goes to `profile`.
VecX estimate_frequency_errors(const Recipe& recipe, const TriMesh& surface, const VecX& omega2,
                               int tets, Profile& profile);

}  // namespace archetide
