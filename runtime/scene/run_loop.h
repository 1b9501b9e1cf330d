#pragma once

#include <functional>
#include <optional>
#include <string>

#include "runtime/simulation.h"

namespace archetide {

/// How far a run goes and when it must stop.
struct RunPlan {
  double end_time = 0.0;             // s
  double fps = 24.0;                 // frames per second of scene time
  std::optional<double> until = {};  // s, stop early after the first step that reaches it
  double least_step = 0.0;           // s, a shorter stable step is an error
  bool resumed = false;              // from the middle of a run: the first frame is written
};

/// Called as the run goes on.
struct RunEvents {
  std::function<void(const StepReport&)> on_step;
  std::function<void()> on_frame;        // also for the initial state
  std::function<bool()> stop_requested;  // asked before every step
};

enum class RunEnd { kDone, kStopped };

/// Steps the simulation to the end of the plan; steps are shortened evenly so that they land on the
/// frames. Throws SimulationFailure when the simulation says so.
RunEnd run_frames(Simulation& simulation, const RunPlan& plan, const RunEvents& events);

/// Frames that a run of `end_time` seconds writes, the initial state included.
int frame_count(double end_time, double fps);

/// The next step of an even split of `remaining` seconds: no longer than `stable`, or by a twentieth
/// where that saves a step, and than `most`, the step.max of the scene, but for its last decimal (all s).
double next_step(double remaining, double stable, double most);

}  // namespace archetide
