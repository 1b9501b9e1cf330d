#pragma once

#include "runtime/contact/contact_rows.h"

namespace archetide {

/// Impulses on the body at m contact points.
struct ContactImpulses {
  VecX normal;         // m, >= 0, N s
  VecX tangent;        // 2 m, |tangent_k| <= friction * normal_k, N s
  int iterations = 0;  // turns of Gauss-Seidel
};

/// Impulses that only push and obey Coulomb's law, and the velocity y that they leave (in place):
/// every point k separates at least at target_k (m/s; 0: stops), with no impulse where it separates
/// faster; a point slides against its friction impulse or sticks. Redundant points are ordinary.
/// Without friction by the active set, exact; friction then by projected Gauss-Seidel [Jea99],
/// until changes are 1e-14 of the largest speed at the points, or 2000 turns.
ContactImpulses push_apart(const GeneralisedMass& H, const MatX& normals, const MatX& tangents,
                           const VecX& target, double friction, VecX& y);

/// normalsᵀ λ_n + tangentsᵀ λ_t, 6 + r: entries 0-2 change P, 3-5 change L (about the centre of
/// mass).
VecX generalised_impulse(const MatX& normals, const MatX& tangents,
                         const ContactImpulses& impulses);

}  // namespace archetide
