#pragma once

#include "runtime/position_stage.h"

namespace archetide {

/// How the bodies that joints hold begin a step; of others `y` is empty. Empty without joints.
std::vector<JointedStart> jointed_starts(const SimulationState& s);

/// Whether the joints have done work, sum f . (y^n + y^{n+1}) / 2, that they cannot do: f their
/// impulses of both stages, y^n of `half.start`, y^{n+1} of the velocities stage (Eq. S12a). Joints
/// give and take little of it; where a light chain snaps tight within a step they give much
/// [D62]. Not asked of bodies with modes, nor where contact has changed a jointed body in between.
bool joints_drive(const SimulationState& s, const HalfStep& half,
                  const std::vector<StageResult>& results);

}  // namespace archetide
