#pragma once

#include "runtime/state.h"

namespace archetide {

/// The longest step that the CFL number, waves of one cell and max_dt allow now, s: with speed v
/// (m/s) and a way l (m), v dt + g dt^2 <= l and dt <= sqrt(dx / g) (S0). Nonlinear bodies turn by
/// at most 0.35 rad.
double stable_dt(const SimulationState& s);

}  // namespace archetide
