#pragma once

#include <random>

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// Uniform in [0, 1) from the 53 high bits: the same numbers with every standard library.
inline double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

inline Vec3 uniform_point(const BoxSpec& box, std::mt19937_64& random) {
  Vec3 x;
  for (int a = 0; a < 3; ++a) x[a] = box.low[a] + (box.high[a] - box.low[a]) * uniform(random);
  return x;
}

}  // namespace archetide
