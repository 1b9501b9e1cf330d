#pragma once

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Triangles of about the same `edge` (m) on the same surface, [BK04]; edges
/// sharper than `sharp_angle` (degrees between face normals) stay.
TriMesh remesh_surface(const TriMesh& surface, double edge, double sharp_angle);

}  // namespace archetide
