#pragma once

#include <functional>

#include "runtime/simulation.h"

namespace archetide {

/// Water whose signed distance is phi(x) at the cell centres, at rest.
FluidState water_where(const Grid& g, const std::function<double(const Vec3&)>& phi);

/// Water below the height `level`, m (infinite: a full tank), at rest.
FluidState water_to(const Grid& g, double level);

/// Sets the faces of `state` to the velocity field v, m/s.
void set_velocity(const Grid& g, const std::function<Vec3(const Vec3&)>& v, FluidState& state);

/// Signed distance to a box, m.
double box_distance(const Vec3& x, const Vec3& low, const Vec3& high);

/// Height of the water over the floor at (x, y), up to the first air, m; linear between cell
/// centres.
double water_height(const Grid& g, const Array3<double>& phi, double x, double y);

}  // namespace archetide
