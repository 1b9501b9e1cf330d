#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// From key to key, rad: 120 degrees, and round-off. Beyond, the way is not clear.
constexpr double kMostTurn = 2.0944;

/// A rigid motion over time (docs/method.md, S8e): cubic between its keys, at rest before the first and
/// after the last. Velocities at the keys between are those of the parabola through a key and its
/// neighbours; turns are quaternions that are interpolated so and made unit.
struct MotionPath {
  struct Key {
    double t = 0.0;             // s
    Vec3 shift = Vec3::Zero();  // m
    Quat turn = Quat::Identity();
  };
  struct State {
    Vec3 shift = Vec3::Zero();  // m
    Quat turn = Quat::Identity();
    Vec3 velocity = Vec3::Zero();  // d shift / dt, m/s
    Vec3 spin = Vec3::Zero();      // of the turn, world frame, rad/s
  };
  std::vector<Key> keys;  // ascending, at least one, apart by at most kMostTurn

  /// At time t (s).
  State at(double t) const;
};

/// A body that goes as a path tells: its surface as it was placed is turned about `origin`, and
/// shifted.
struct PrescribedBody {
  int body = -1;
  Vec3 origin = Vec3::Zero();  // m
  Vec3 arm = Vec3::Zero();     // centre of mass as placed, from the origin, m
  MotionPath path;

  struct Pose {
    Vec3 position = Vec3::Zero();                       // of the centre of mass, m
    Quat rotation = Quat::Identity();                   // as placed to world
    Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();  // m/s, rad/s
  };
  Pose at(double t) const;
};

}  // namespace archetide
