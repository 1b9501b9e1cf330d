#pragma once

#include "common/base/types.h"

namespace archetide {

/// How a body goes through one step that goes as it is told (docs/method.md, S8e): translation of its
/// centre, m/s, and spin, rad/s.
struct PrescribedMotion {
  Vec3 way = Vec3::Zero(), turn = Vec3::Zero();  // constant ones that bring it to the step's end
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // that it has there
};

}  // namespace archetide
