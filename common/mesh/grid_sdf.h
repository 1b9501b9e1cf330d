#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Signed distance sampled on the nodes of a regular grid; negative inside. Trilinear between
/// nodes.
struct GridSdf {
  Vec3 origin = Vec3::Zero();  // position of node (0,0,0), m
  double spacing = 0.0;        // m
  Vec3i nodes = Vec3i::Zero();
  std::vector<float> values;  // nodes.prod(), x fastest, m

  /// Distance at x, m; outside the grid the boundary value plus the distance to the grid's box;
  /// +infinity if the grid is empty.
  double value(const Vec3& x) const;
  /// Gradient of value() (not normalised); zero if the grid is empty.
  Vec3 gradient(const Vec3& x) const;
};

}  // namespace archetide
