#pragma once

#include <cmath>

#include "common/base/axial.h"

namespace archetide {

/// Rotation by the vector a (axis times angle, rad), unit quaternion, exact for every angle.
inline Quat rotation_exponential(const Vec3& a) {
  const double angle = a.norm();
  // sin(x)/x, series below 1e-4 where its first neglected term is under 1e-17.
  const double half = 0.5 * angle;
  const double sinc = half < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half;
  const Vec3 v = 0.5 * sinc * a;
  return Quat(std::cos(half), v.x(), v.y(), v.z());
}

}  // namespace archetide
