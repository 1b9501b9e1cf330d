#pragma once

#include <string>

#include "runtime/output/surface_mesh.h"

namespace archetide {

/// Binary little-endian PLY: float32 x y z nx ny nz, faces as uchar count and int32 indices. `body`
/// is not stored. Atomic; throws MachineError.
void write_ply(const std::string& path, const SurfaceMesh& mesh);

/// Reads what write_ply wrote. Throws FileError for anything else, truncated files included.
SurfaceMesh read_ply(const std::string& path);

}  // namespace archetide
