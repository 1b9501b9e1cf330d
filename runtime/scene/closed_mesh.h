#pragma once

#include <string>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Reads a closed surface (OBJ, OFF, PLY or STL; equal corners are one vertex) and returns it
/// outward oriented. Throws FileError when it cannot be read, InputError when it is malformed or
/// not closed and consistently oriented.
TriMesh read_closed_mesh(const std::string& path);

}  // namespace archetide
