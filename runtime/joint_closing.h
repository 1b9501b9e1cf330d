#pragma once

#include <vector>

#include "runtime/state.h"
#include "runtime/step_report.h"

namespace archetide {

/// Velocities y of the position update that leave no gap in a joint (Section 7, [WTF06]); bodies that
/// are `stopped` keep their modal rates. What that takes joins the joints' `reaction`. False, and the
/// attempt refused, where a joint stays open.
bool close_joints(const SimulationState& s, const std::vector<FreeMotion>& motions,
                  const std::vector<char>& stopped, double dt, std::vector<VecX>& y,
                  std::vector<VecX>& reaction, StepAttempt& attempt);

/// Closes joints again after nonlinear bodies have got another shape (S15) than the one that closed them:
/// bodies shift as impulses of the joints would move them, `stiff` ones as they are bent (Eq. S15c).
/// Momenta about the origin stay. False, and nothing changed, where joints stay open.
bool seat_joints(const SimulationState& s, const std::vector<FreeMotion>& motions,
                 const std::vector<char>& stiff, double dt, std::vector<ReducedBody>& bodies);

}  // namespace archetide
