#pragma once

#include <vector>

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Of all bodies together; L about the origin.
struct Momenta {
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();  // kg m/s, kg m^2/s
};
inline Momenta momenta_of(const std::vector<ReducedBody>& bodies) {
  Momenta sum;
  for (const ReducedBody& b : bodies) sum.P += b.P, sum.L += b.L + b.position.cross(b.P);
  return sum;
}

}  // namespace archetide
