#pragma once

#include <string>

#include "common/tri_mesh.h"

namespace archetide {

/// Reads a Wavefront OBJ surface (v and f lines; polygons become fans) and returns it outward
/// oriented. Throws FileError when it cannot be read, InputError with file:line when it is
/// malformed or not closed.
TriMesh read_closed_obj(const std::string& path);

}  // namespace archetide
