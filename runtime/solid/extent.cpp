#include "runtime/solid/extent.h"

#include <algorithm>

namespace archetide {

double bounding_radius(const Archetype& archetype) {
  double radius = 0.0;
  for (const Vec3& x : archetype.surface.vertices) radius = std::max(radius, x.norm());
  return radius;
}

double largest_displacement(const VecX& u) {
  double largest = 0.0;
  for (Eigen::Index row = 0; row < u.size(); row += 3)
    largest = std::max(largest, u.segment<3>(row).norm());
  return largest;
}

}  // namespace archetide
