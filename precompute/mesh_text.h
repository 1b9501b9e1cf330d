#pragma once

#include <string>

#include "precompute/build.h"

namespace archetide {

/// What `check` prints about a mesh.
std::string mesh_text(const Recipe& recipe, const BodyMesh& body);

}  // namespace archetide
