#pragma once

#include <cmath>

#include "common/base/types.h"

namespace archetide {

/// [a], the matrix of the cross product: skew(a) b = a x b.
inline Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// sum_bc eps_abc M_bc: the vector sum of y x phi when M = sum of y phi^T.
inline Vec3 axial(const Mat3& m) {
  return Vec3(m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0));
}

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
