#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// A triangle surface as frames store it. `body` is empty for water, else one id per vertex.
struct SurfaceMesh {
  std::vector<Vec3> vertices;    // n, m
  std::vector<Vec3> normals;     // n, unit, outward
  std::vector<Vec3i> triangles;  // nf, counter-clockwise seen from outside
  std::vector<int> body;         // n or empty; a triangle belongs to the body of its vertices
};

}  // namespace archetide
