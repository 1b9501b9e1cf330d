#pragma once

#include "common/mesh/tri_mesh.h"
#include "runtime/scene/scene_spec.h"

namespace archetide {

Grid tank_grid(const FluidSpec& fluid);

/// False for a dry tank: a level of 0 and nothing else.
bool has_water(const WaterSpec& water);

/// Height of the highest point of the initial water, m, world frame.
double highest_water(const FluidSpec& fluid);

/// Signed distance of x to the initial water, m, negative in it; infinite where there is none, and
/// for the water of a mesh.
double water_distance(const FluidSpec& fluid, const Vec3& x);

/// Water with its velocities (no field: at rest): phi is the signed distance to the union of
/// everything the scene gives, no grid cells means no tank. A full tank and a dry one lie a whole
/// tank away from any surface.
FluidState initial_fluid(const std::optional<FluidSpec>& fluid);

/// phi <- min(phi, distance to a closed outward surface), exact within three cells of it.
void add_mesh(const Grid& g, const TriMesh& mesh, Array3<double>& phi);

/// Distance from x to the triangle a, b, c.
double distance_to_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace archetide
