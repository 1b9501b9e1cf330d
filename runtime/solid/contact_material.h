#pragma once

#include <algorithm>
#include <cmath>

namespace archetide {

/// How a surface bounces and rubs.
struct ContactMaterial {
  double restitution = 0.0;  // 0 .. 1
  double friction = 0.0;     // Coulomb's coefficient
};

/// Of two surfaces that meet: the livelier one bounces, and friction is the geometric mean, so that
/// ice is slippery against everything. Two of one kind are that kind.
inline ContactMaterial pair_material(const ContactMaterial& a, const ContactMaterial& b) {
  return {std::max(a.restitution, b.restitution),
          a.friction == b.friction ? a.friction : std::sqrt(a.friction * b.friction)};
}

}  // namespace archetide
