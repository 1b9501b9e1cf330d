#pragma once

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Energy that a nonlinear body got from nothing in the velocities stage because its forces are
/// linear about middle.rates_of_force() (S15b), J: V(q^{n+1}) - V(q^n) less the work of
/// these forces. `motion`: of the stage; `q_end`: q^{n+1} (r); the rest as of corrected_modes().
double energy_of_linear_force(const ReducedBody& body, const Configuration& middle,
                              const FreeMotion& motion, const VecX& q_dot, const VecX& q_end,
                              double dt);

/// Impulse that a load gives the modes of a nonlinear body in the velocities stage because it follows
/// them (S14a), beyond that of the force that free_motion() got, r, N m s; empty: it does not.
/// `middle`, `motion`: of the stage.
VecX impulse_of_following_load(const ReducedBody& body, const Configuration& middle,
                               const FreeMotion& motion, const VecX& q_dot, double dt);

/// Rates that the position stage leaves out where the elastic force is linear about other rates than
/// the q_dot (r) that came out: M_hat^-1 dt/2 (F(q_dot) - what the stage took for it), r (S13b).
/// `motion`: of the stage.
VecX rest_of_linear_force(const ReducedBody& body, const FreeMotion& motion, const VecX& q_dot,
                          double dt);

}  // namespace archetide
