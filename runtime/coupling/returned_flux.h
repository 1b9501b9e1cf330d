#pragma once

#include <vector>

#include "runtime/pressure/coupled_operator.h"

namespace archetide {

/// What bodies push together into each region of closed water with the velocity of the step's start
/// (CoupledBody::y_before) is asked of them with the opposite sign at its end: adds that to the
/// right-hand side `rhs` of Eq. 45, m/s (per dx^2), in shares of the cells' openings (C16a) [D87].
/// The pressure of closed water, which holds the volume, then does no work over the step.
void return_flux(const CoupledOperator& op, double dx, const std::vector<CoupledBody>& bodies,
                 double* rhs);

}  // namespace archetide
