#pragma once

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// Points uniform in the water (phi < 0) of every box and ball, the same for the same seed. Throws
/// InputError where there is almost no water.
std::vector<Vec3> place_markers(const std::vector<MarkersSpec>& specs, const Grid& g,
                                const Array3<double>& phi);

}  // namespace archetide
