#pragma once

#include "common/mesh/grid_sdf.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

struct SdfOptions {
  int cells =
      64;  // along the longest side of the surface, 8 .. 512; cost and bytes grow with its cube
  int margin = 3;  // cells around the bounding box, so that contact and fractions see the outside
};

/// Signed distance to a closed, outward oriented surface on a grid around it. Exact near the
/// surface; farther out the closest triangle is passed on from node to node, which can miss a
/// closer one by a small part of a cell.
GridSdf sample_distance(const TriMesh& surface, const SdfOptions& options = {});

/// How often the closed surface winds around x: 1 inside, 0 outside (solid angles, [OS83]).
double winding_number(const TriMesh& mesh, const Vec3& x);

/// The point of triangle (a, b, c) closest to x, [Eri05], 5.1.5.
Vec3 closest_point_on_triangle(const Vec3& x, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace archetide
