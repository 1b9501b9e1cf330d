#pragma once

#include <vector>

#include "runtime/articulation/joint.h"

namespace archetide {

struct PreStabilised {
  std::vector<VecX> impulse;  // per body with joints, 6 + r, N s: C^T lambda
  double drift = 0.0;         // m, that is left ..
  int widest = -1;            // .. and in which joint
  int turns = 0;
  bool converged = false;  // below `tolerance`
  bool closed = false;     // below `acceptable`
};

/// [WTF06]: impulses along the joints' rows at x^n that close the joints at the end of the position
/// update, outside the coupled solve (Section 7). Together with the rows of the coupled solve they
/// are the impulse of RATTLE [And83]: they take part in the momenta of the step, which
/// makes it second order and keeps angular momentum. `motions`: of the position stage, one per
/// body; `y`: its velocities, in and out. Bodies with `stiff` keep the modal rates that they have
/// in y, and take no impulse on their modes.
///
/// Newton's method with a_33 at x^n for the derivative, lambda -= a_33^+ gap / dt, accelerated
/// (Anderson), until the largest gap is below `tolerance` (m). Given up where joints are opened
/// further by impulses of more energy than the bodies move with (what closes them then is another
/// shape far away, not the next one), and where the gap shrinks slowly [D84]. Where more than
/// `acceptable` (m) is left `y` stays as it was.
PreStabilised pre_stabilise(const std::vector<Joint>& joints,
                            const std::vector<ReducedBody>& bodies,
                            const std::vector<FreeMotion>& motions, const std::vector<char>& stiff,
                            double dt, double tolerance, double acceptable, std::vector<VecX>& y);

}  // namespace archetide
