#pragma once

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Bodies that meet nothing, with known answers.

/// Body-frame spin of a rigid body of I = diag(1, 2, 3) that starts with (1e-3, 1, 1e-3), rad/s,
/// after `time` s in so many steps.
Vec3 tumbling_spin(double time, int steps);

/// One mode at rest around it: the two eigenvalues of the step's 2 x 2 matrix are amplitude and
/// angle.
struct Vibration {
  double amplitude_per_period = 0.0, frequency_ratio = 0.0;
};
Vibration measured_vibration(double omega_dt, ModalStep step);
/// The closed form of the same. Trapezoid: amplitude 1, ratio 2 atan(x / 2) / x with x = omega dt.
/// Backward Euler: Section 6 moves q by the half-step velocity, so its two stages are, with v =
/// q'/omega,
///   q' = ((1 - x^2/4) q + x v) / (1 + x^2/4),   v' = (v - x q) / (1 + x^2)
/// of determinant (1 + 3x^2/4) / ((1 + x^2/4)(1 + x^2)): half the damping of backward Euler in both
/// variables (0.855 of the amplitude per period at x = 0.1, against 0.732).
Vibration exact_vibration(double omega_dt, ModalStep step);

/// A blob of modes from `first_omega` rad/s up, spun in vacuum for 5 s, against the rigid one:
/// angle between the two, rad.
double angle_off_rigid(double first_omega);

}  // namespace archetide
