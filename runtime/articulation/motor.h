#pragma once

#include <vector>

#include "runtime/articulation/spring.h"

namespace archetide {

/// A motor between two bodies, or a body and the world: a torque about an axis of the first, and the
/// opposite one on the other, on all particles by their mass. With a no-load speed it falls with the
/// turning of a against b, as that of a direct current motor does.
struct Motor {
  int a = -1, b = -1;         // indices of bodies; b = -1: the world
  Vec3 axis = Vec3::UnitZ();  // of length 1, in the rest frame of a
  double torque = 0.0;        // on a, at rest, N m
  double speed = INFINITY;    // of a against b at which none is left, rad/s
  double period = INFINITY;   // of the supply, s; infinite: it is constant
  double phase = 0.0;         // of its sine, rad
  double start = 0.0;         // s, no torque before ..
  double end = INFINITY;      // .. and after
  bool runs(double t) const { return t >= start && t <= end; }
  /// Share of the full supply at time t (s), -1 to 1.
  double supply(double t) const;
};

/// Adds the torque on both bodies at time t, the middle of a step of dt (s), to their generalised
/// forces (S8f). `placed`: with the velocities of the start of the step.
void add_motor_torque(const Motor& motor, double t, double dt, const PlacedBody& placed,
                      ModalMass mass, std::vector<VecX>& force);

}  // namespace archetide
