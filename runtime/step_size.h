#pragma once

#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// The longest step that the CFL number, waves of one cell and max_dt allow now, s: with speed v
/// (m/s) and a way l (m), v dt + g dt^2 <= l and dt <= sqrt(dx / g) (S0). Nonlinear bodies turn by
/// at most 0.35 rad.
double stable_dt(const SimulationState& s);

/// Whether a step that has come out wrong may be taken again with half the length: at most `most`
/// times for its reason, then it is taken as it is.
bool may_halve(const SimulationOptions& options, const StepReport& report, int most);
constexpr int kMostForEnergy = 6;   // [D62], [D63]
constexpr int kMostForOverlap = 3;  // an overlap is no failure

}  // namespace archetide
