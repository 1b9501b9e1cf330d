#pragma once

#include <vector>

#include "runtime/contact/body_contacts.h"

namespace archetide {

/// Modal coordinates that nonlinear bodies are about to take at the end of a step, Eq. S15a: of each
/// body's change the share that brings no point of `met.near` closer than its gap, or deeper where
/// it overlaps, by more than `slack` (m) [D66]. Of two bodies that both change each may take half.
/// All of the change keeps the energy; what less of it stores must not exceed `available` (J), or
/// the shares are raised. Returns how far raised shares drive bodies into each other, or deeper, m.
/// `met`: at the bodies as they stand; `q`: one per body, r, empty if it does not change.
double keep_apart(const std::vector<ReducedBody>& bodies, const GroupContacts& met, double slack,
                  double available, std::vector<VecX>& q);

}  // namespace archetide
