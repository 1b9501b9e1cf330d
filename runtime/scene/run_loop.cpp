#include "runtime/scene/run_loop.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/input_error.h"
#include "runtime/scene/expectations.h"

namespace archetide {
namespace {

constexpr double kSameTime = 1e-9;  // of a frame: differences below are round-off

void check_limit(const RunPlan& plan, const StepReport& report, double drift) {
  if (!plan.volume_drift_limit || std::abs(drift) <= *plan.volume_drift_limit) return;
  std::ostringstream message;
  message << "the water's volume drifted by " << 100.0 * drift << " % by t = " << report.t
          << " s, the limit is " << 100.0 * *plan.volume_drift_limit
          << " % (limits.volume_drift); use a finer grid, a smaller step.cfl or fluid.particles";
  throw NumericsError(message.str());
}

// Steps until `target`; false when asked to stop before.
bool advance_to(double target, double frame, Simulation& simulation, const RunPlan& plan,
                const RunEvents& events, VolumeDrift& drift) {
  for (;;) {
    const double remaining = target - simulation.time();
    if (remaining < kSameTime * frame) return true;
    if (events.stop_requested()) return false;
    const double stable = simulation.stable_dt();
    if (!(stable > kSameTime * frame)) {
      throw NumericsError("the stable step fell to " + std::to_string(stable) + " s at t = " +
                          std::to_string(simulation.time()) + " s: the velocities blew up");
    }
    const StepReport report = simulation.step(next_step(remaining, stable));
    events.on_step(report);
    check_limit(plan, report, drift.observe(report));
  }
}

}  // namespace

double next_step(double remaining, double stable) {
  return remaining / std::max(1.0, std::ceil(remaining / stable - 1e-9));
}

RunEnd run_frames(Simulation& simulation, const RunPlan& plan, const RunEvents& events) {
  const double frame = 1.0 / plan.fps;
  const bool cut = plan.until && *plan.until < plan.end_time - kSameTime * frame;
  const double end = cut ? *plan.until : plan.end_time;
  VolumeDrift drift;
  events.on_frame();
  for (long n = 1; simulation.time() < end - kSameTime * frame; ++n) {
    const double frame_end = std::min(n * frame, plan.end_time);
    const double target = std::min(frame_end, end);
    if (!advance_to(target, frame, simulation, plan, events, drift)) return RunEnd::kStopped;
    if (target >= frame_end) events.on_frame();
  }
  return cut ? RunEnd::kStopped : RunEnd::kDone;
}

}  // namespace archetide
