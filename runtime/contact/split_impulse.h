#pragma once

#include <vector>

#include "runtime/contact/body_contacts.h"

namespace archetide {

/// Pushes of the position stage move poses and leave momenta alone [D48]: overlaps are not to turn
/// into momentum. Centres that are moved alone, though, change sum t x P, by dt f x (v_a - v_b) for
/// each push f of body b on body a. So a push is given at x^n and taken back at x^{n+1}, each time
/// equal and opposite at one common point: P stays, and L of the two changes by what their levers
/// have changed. Linear and angular momentum of all bodies then stay to round-off.
///
/// `reachable`: of the position stage that moved the bodies. `reaction`: per body, what its joints
/// gave in that stage and will give to P, 6 + r, N s; or empty.
void split_impulses(const GroupContacts& reachable, const std::vector<VecX>& reaction, double dt,
                    std::vector<ReducedBody>& bodies);

}  // namespace archetide
