#include "runtime/scene/run_loop.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "runtime/scene/limits.h"

namespace archetide {
namespace {

constexpr double kSameTime = 1e-9;  // of a frame: differences below are round-off

// Steps until `target`; false when asked to stop before. Steps are the same whether the run is
// stopped or not.
bool advance_to(double target, double frame, Simulation& simulation, const RunPlan& plan,
                const RunEvents& events) {
  for (;;) {
    const double remaining = target - simulation.time();
    if (remaining < kSameTime * frame) return true;
    const bool until = plan.until && simulation.time() >= *plan.until - kSameTime * frame;
    if (until || events.stop_requested()) return false;
    const double stable = simulation.stable_dt();
    if (!(stable > std::max(kSameTime * frame, plan.least_step)))
      throw SimulationFailure(
          plan.least_step > 0.0 ? "limits.step" : "step",
          fmt::format("the stable step fell to {:f} s: velocities blew up", stable),
          simulation.time(), fastest(simulation));
    events.on_step(simulation.step(next_step(remaining, stable, simulation.options().max_dt)));
  }
}

}  // namespace

// Stable steps have margins, the one with least the waves of one cell: omega dt = 1.86 < 2.
double next_step(double remaining, double stable, double most) {
  constexpr double kLonger = 1.05;    // than stable, where that saves one of the steps of a frame
  constexpr double kRounded = 1.002;  // 0.0416 means 1/24
  const double longest = std::min(kLonger * stable, kRounded * most);
  return remaining / std::max(1.0, std::ceil(remaining / longest - 1e-9));
}

int frame_count(double end_time, double fps) {
  return 1 + static_cast<int>(std::ceil(end_time * fps - kSameTime));
}

RunEnd run_frames(Simulation& simulation, const RunPlan& plan, const RunEvents& events) {
  const double frame = 1.0 / plan.fps;
  if (!plan.resumed) events.on_frame();
  auto n = static_cast<long>(simulation.time() / frame + kSameTime);
  while (simulation.time() < plan.end_time - kSameTime * frame) {
    ++n;
    const double target = std::min(n * frame, plan.end_time);
    if (!advance_to(target, frame, simulation, plan, events)) return RunEnd::kStopped;
    events.on_frame();
  }
  return RunEnd::kDone;
}

}  // namespace archetide
