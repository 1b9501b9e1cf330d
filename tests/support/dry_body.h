#pragma once

#include "runtime/solid/nonlinear_motion.h"

namespace archetide {

inline ReducedBody make_body(std::shared_ptr<const Archetype> archetype, int r) {
  ReducedBody body;
  body.archetype = std::move(archetype);
  body.r = r;
  body.q = VecX::Zero(r);
  body.q_dot = VecX::Zero(r);
  return body;
}

/// One whole step of a body that meets nothing but a constant generalised force (6 + r).
inline void dry_step(ReducedBody& body, const VecX& force, double dt, const ModalOptions& options) {
  const FreeMotion half =
      free_motion(body, current_configuration(body), force, dt, Stage::kPositionHalf, options);
  const Configuration mid = advance_pose(body, half, half.y_star, dt);
  const FreeMotion full = free_motion(body, mid, force, dt, Stage::kVelocityFull, options);
  if (body.is_nonlinear()) body.q = corrected_modes(body, mid, full.y_star.tail(body.r), dt);
  accept_velocity(body, full.y_star, dt * force.head<3>(), dt * force.segment<3>(3));
}

inline void dry_steps(ReducedBody& body, int count, double dt, const ModalOptions& options) {
  for (int i = 0; i < count; ++i) dry_step(body, VecX::Zero(body.dofs()), dt, options);
}

}  // namespace archetide
