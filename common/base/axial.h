#pragma once

#include "common/base/types.h"

namespace archetide {

/// The matrix of a x.
inline Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

/// d det F / dF: takes a normal of a surface along with x -> F x.
inline Mat3 cofactor(const Mat3& F) {
  Mat3 c;
  c << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
  return c;
}

/// sum_bc eps_abc M_bc: the vector sum of y x phi when M = sum of y phi^T.
inline Vec3 axial(const Mat3& m) {
  return Vec3(m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0));
}

}  // namespace archetide
