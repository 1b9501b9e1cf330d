#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// A force and a torque from outside on one body, in the world frame. They act on each particle by
/// its mass, as weight does: they move the body and deform it no more than its turning does.
struct ExternalLoad {
  struct Sample {
    double t = 0.0;              // s
    Vec3 force = Vec3::Zero();   // N
    Vec3 torque = Vec3::Zero();  // about the centre of mass, N m
  };
  int body = -1;
  std::vector<Sample> samples;         // ascending, at least one: linear in between, held beyond
  double start = 0.0, end = INFINITY;  // s, nothing before and after

  /// Force and torque at time t (s).
  Sample at(double t) const;
};

}  // namespace archetide
