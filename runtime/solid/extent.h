#pragma once

#include "common/archetype/archetype.h"

namespace archetide {

/// Largest distance of a surface point from the centre of mass, m; a body without deformation.
double bounding_radius(const Archetype& archetype);

/// The largest of n displacements, 3 n numbers, m.
double largest_displacement(const VecX& u);

}  // namespace archetide
