#pragma once

#include <string>
#include <vector>

#include "common/base/types.h"

namespace archetide {

/// A smooth solid: inside where `value` is negative. `value` is continuous and close to a distance
/// in m.
struct Shape {
  std::string name;
  std::string comment;             // first line of the OBJ file
  double (*value)(const Vec3& x);  // x in m
  Vec3 low, high;                  // box around the solid with a margin, m
  double cell;                     // edge length of the surface triangles, about, m
};

/// sphere, torus, starfish and jellyfish, centred on the z axis, z up; two rocks.
const std::vector<Shape>& all_shapes();

/// Gradient of the shape's value by central differences.
Vec3 gradient(const Shape& shape, const Vec3& x);

/// The point of the surface value = 0 near x (Newton steps along the gradient).
Vec3 project(const Shape& shape, Vec3 x);

}  // namespace archetide
