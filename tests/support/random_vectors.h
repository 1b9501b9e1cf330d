#pragma once

#include <random>

#include "common/base/types.h"

namespace archetide {

/// Numbers drawn in one order, the last component first; in which order a compiler evaluates the
/// arguments of a call is its own.
template <class Distribution>
Vec3 random_vec3(Distribution& draw, std::mt19937& random) {
  Vec3 v;
  for (int a = 2; a >= 0; --a) v[a] = draw(random);
  return v;
}

/// Four of them: x, y, z drawn as those of a vector, then w; of length 1.
template <class Distribution>
Quat random_rotation(Distribution& draw, std::mt19937& random) {
  const Vec3 v = random_vec3(draw, random);
  return Quat(draw(random), v[0], v[1], v[2]).normalized();
}

}  // namespace archetide
