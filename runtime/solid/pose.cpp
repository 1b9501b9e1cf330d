#include "runtime/solid/reduced_body.h"
#include "runtime/solid/rotation.h"

namespace archetide {
namespace {

/// Spin of the frame at the midpoint: ω = I⁻¹(L − D q̇) with I, D of (R_mid, q_mid) and R_mid =
/// exp(dt/2 ω) R. A fixed point; at dt |ω| < 1 it contracts to round-off in about ten turns, each a
/// few 3 x 3 products.
Vec3 midpoint_spin(const ReducedBody& body, const Configuration& mid, const Vec3& L, double dt,
                   const Vec3& first_guess) {
  constexpr int kMaxTurns = 50;
  constexpr double kTurnTolerance = 1e-15;  // rad, of the half step's rotation
  const Moments moments = deformed_moments(body, mid.q);
  const Mat3 inertia = moments.Syy.trace() * Mat3::Identity() - moments.Syy;
  const Mat3 inertia_inverse = inertia.inverse();
  const Vec3 modes_L =
      angular_momentum_of_modes(body, moments, mid.q_dot);  // D q̇ in the body frame

  Vec3 spin = first_guess;
  for (int turn = 0; turn < kMaxTurns; ++turn) {
    const Quat R = rotation_exponential(0.5 * dt * spin) * body.rotation;
    const Vec3 next = R * (inertia_inverse * (R.conjugate() * L - modes_L));
    const double change = 0.5 * dt * (next - spin).norm();
    spin = next;
    if (change <= kTurnTolerance) break;
  }
  return spin;
}

}  // namespace

Configuration advance_pose(ReducedBody& body, const FreeMotion& stage, const VecX& y, double dt) {
  Configuration mid;
  mid.q_dot = y.tail(body.r);
  mid.q = body.q + 0.5 * dt * mid.q_dot;
  const Vec3 L_half = stage.terms.inertia * y.segment<3>(3);
  mid.delta_L = L_half - body.L;

  const Vec3 guess = y.segment<3>(3) - stage.terms.spin_of_modes * mid.q_dot;
  const Vec3 spin = midpoint_spin(body, mid, L_half, dt, guess);
  mid.rotation = (rotation_exponential(0.5 * dt * spin) * body.rotation).normalized();

  body.rotation = (rotation_exponential(dt * spin) * body.rotation).normalized();
  body.position += dt * y.head<3>();
  body.q += dt * mid.q_dot;
  return mid;
}

// Eq. S15.
VecX corrected_modes(const ReducedBody& body, const Configuration& middle, const VecX& q_dot,
                     double dt) {
  const VecX q_n = 2.0 * middle.q - body.q;
  return q_n + 0.5 * dt * (body.q_dot + q_dot);
}

}  // namespace archetide
