#pragma once

#include <vector>

#include "runtime/state.h"

namespace archetide {

/// A jointed rigid body at the start of a step.
struct JointedStart {
  VecX y;  // 6
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();
};

/// How the bodies that joints hold begin a step; of others `y` is empty. Empty where no joints are
/// or one of these bodies has modes: what joints do to implicit rates is not their work.
std::vector<JointedStart> jointed_starts(const SimulationState& s);

/// Whether the joints have done work, sum f . (y^n + y^{n+1}) / 2, that they cannot do: f their
/// impulses of both stages (`reaction` of the positions), y^n of `starts`, y^{n+1} of the velocities
/// stage (Eq. S12a). Joints give and take little of it; where a light chain snaps tight within a
/// step they give much [D62]. Not asked where contact has changed a jointed body in between.
bool joints_drive(const SimulationState& s, const std::vector<JointedStart>& starts,
                  const std::vector<VecX>& reaction, const std::vector<StageResult>& velocities);

}  // namespace archetide
