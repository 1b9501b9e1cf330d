#pragma once

#include <algorithm>

#include "runtime/grid/grid.h"

namespace archetide {

/// The pieces of a second-order time splitting at two pressure solves a step, after the
/// advection-reflection of [ZNT18] (docs/method.md, W1, W4, W6). With A_h(v; w) the advection of v
/// by w over h, Γ = (dt/2) grad p' / rho the push of the half-step solve, and η in [0, 1] the share
/// that is reflected (1 but for impacts):
///     u^{n+1/2} = A_{dt/2}(u^n; w^{n+1/4}) - Γ
///     u*        = A_{dt/2}(u^{n+1/2} - η Γ; w^{n+3/4}) + (1 + η) Γ
/// What the last line gives back the full-step solve takes again: the difference to the plain
/// splitting is the commutator of advection and pressure alone, so that still water stays still and
/// the full-step solve keeps the whole pressure impulse, on bodies too.

/// How much of an acceleration is taken for the flow's own, by its size in usual ones: all up to 1,
/// nothing from 2 on, where it is an impact's [D38].
inline double share_without_impact(double size) {
  constexpr double kAllOf = 1.0, kNothingOf = 2.0;
  return std::min(std::max((kNothingOf - size) / (kNothingOf - kAllOf), 0.0), 1.0);
}

/// out = now + steps (now - before) on faces with valid == 1, and `now` elsewhere: the velocity
/// `steps` intervals later.
void continue_in_time(const MacField& now, const MacField& before, double steps,
                      const FaceField<unsigned char>& valid, MacField& out);

/// What is reflected. A push beyond the `usual` size, m/s, is an impact's: in deep water it is
/// reflected as well, but near the surface the share falls from 1 to 0 between 1 and 2 times that
/// (0: 1 everywhere). Reflected as a whole, the pushes of films along a wall that flicker between
/// water and air drove them from 10 to 1e8 m/s [D21].
struct Reflection {
  const MacField& push;                  // m/s
  double usual;                          // m/s
  const FaceField<unsigned char>& deep;  // faces of water well below the surface
};

/// Both ends of the reflection around the advection of `u`: carrier = u + steps (u - before) on
/// faces with valid == 1, elsewhere it stays, and u -= r push where valid != 0 ..
void start_reflection(const MacField& before, double steps, const Reflection& reflection,
                      const FaceField<unsigned char>& valid, MacField& u, MacField& carrier);
/// .. and, with u advected to u_star, u += r push where valid != 0 and u_star += (1 + r) push where
/// target != 0.
void end_reflection(const Reflection& reflection, const FaceField<unsigned char>& valid,
                    const FaceField<unsigned char>& target, MacField& u, MacField& u_star);

/// push = push - u on faces with valid == 1, 0 elsewhere: what a solve took from the velocity that
/// `push` held.
void subtract_solved(const MacField& u, const FaceField<unsigned char>& valid, MacField& push);

/// u += factor * push on faces with target != 0.
void add_push(const MacField& push, double factor, const FaceField<unsigned char>& target,
              MacField& u);

}  // namespace archetide
