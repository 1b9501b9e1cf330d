#pragma once

#include "assets/generate/shapes.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Closed outward triangle surface of a shape: dual (surface nets) polygons of a grid of
/// shape.cell, vertices projected onto the shape, then evened out by tangential smoothing and
/// Delaunay edge flips.
TriMesh mesh_surface(const Shape& shape);

}  // namespace archetide
