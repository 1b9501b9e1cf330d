#pragma once

#include <vector>

#include "runtime/contact/contact_search.h"

namespace archetide {

/// Moves points out of bodies and obstacles.
class PushOut {
 public:
  /// `spacing` of the obstacles' distances, m.
  PushOut(const std::vector<TriMesh>& obstacles, double spacing);

  /// Points less than `clearance` (m) from a solid, or in it, go along its normal to there.
  void move_out(const std::vector<ReducedBody>& bodies, double clearance,
                std::vector<Vec3>& points);

 private:
  Surroundings obstacles_;
  ShapeLibrary shapes_;
};

}  // namespace archetide
