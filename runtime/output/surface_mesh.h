#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// A triangle surface as frames store it. Water has no `body` and no `rest`.
struct SurfaceMesh {
  std::vector<Vec3> vertices;    // n, m
  std::vector<Vec3> normals;     // n, unit, outward
  std::vector<Vec3i> triangles;  // nf, counter-clockwise seen from outside
  std::vector<int> body;         // n or empty; a triangle belongs to the body of its vertices
  std::vector<Vec3> rest;        // n or empty, where they are in the undeformed body, m
};

}  // namespace archetide
