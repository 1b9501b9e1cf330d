#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Diagonal of the box along the axes that holds the points, m.
inline double bounding_diagonal(const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : points) box.extend(x);
  return box.diagonal().norm();
}

}  // namespace archetide
