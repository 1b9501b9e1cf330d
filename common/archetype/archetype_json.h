#pragma once

#include <string>

#include "common/archetype/archetype.h"

namespace archetide {

/// What any program tells about an archetype: name, generator, mesh, material, damping,
/// surface_vertices, volume, mass, center, inertia, nonlinear, frequencies_hz, is_static,
/// frequency_error, residuals, quality, point_sets, joint_frames, ladder, hash, bytes
/// (`file_bytes`, of its file). SI units.
std::string archetype_json(const Archetype& a, std::size_t file_bytes);

}  // namespace archetide
