#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Water that comes into the tank: a box or a ball that is full of it at the start of every step, all
/// of it at one velocity.
struct WaterSource {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // m; of a ball the cube around it
  bool ball = false;
  Vec3 velocity = Vec3::Zero();        // m/s
  double start = 0.0, end = INFINITY;  // s

  bool pours(double t) const { return t > start - 1e-9 && t < end - 1e-9; }
  double distance(const Vec3& x) const;  // signed, negative inside, m
};

/// Water that has come in: its volume, m^3, and first moment about the origin, m^4.
struct FilledSource {
  double volume = 0.0;
  Vec3 moment = Vec3::Zero();
};
/// Fills it: phi and what cells hold (dx^3) there and around, and its velocity on the faces in it, in all
/// fields; they count as solved for (valid = 1).
FilledSource fill_source(const Grid& g, const WaterSource& source, const Array3<double>& solid,
                         Array3<double>& phi, Array3<double>& held,
                         const std::vector<MacField*>& fields, FaceField<unsigned char>& valid);

/// Sets the marks of faces up to so many cells around it to 0.
void forget_around(const Grid& g, const WaterSource& source, int cells,
                   FaceField<unsigned char>& marks);

/// Momentum, angular momentum about the origin and kinetic energy of the water over its density; of a
/// face the mass is half of what both its cells hold. Threads do not change the sums.
struct HeldMotion {
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();  // m^4/s, m^5/s
  double kinetic = 0.0;                     // m^5/s^2
};
HeldMotion held_motion(const Grid& g, const Array3<double>& held, const MacField& u);

}  // namespace archetide
