// Simulates a scene: from its first state or from a checkpoint, to the end or until it is stopped.

#include <fmt/core.h>
#include <omp.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "common/base/memory.h"
#include "runtime/commands/claim_run_folder.h"
#include "runtime/commands/command.h"
#include "runtime/commands/failed_run.h"
#include "runtime/commands/interrupt.h"
#include "runtime/output/run_description.h"
#include "runtime/output/run_lock.h"
#include "runtime/output/run_writer.h"
#include "runtime/scene/expectations.h"
#include "runtime/scene/initial_water.h"
#include "runtime/scene/limits.h"
#include "runtime/scene/run_loop.h"
#include "runtime/scene/scene_builder.h"
#include "runtime/water_step.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

RunSetup run_setup(const SceneSpec& scene, const RunPlan& plan, const Arguments& a,
                   const std::vector<std::string>& body_names) {
  RunSetup setup;
  setup.directory = a.out;
  setup.scene_name = scene.name;
  setup.scene_text = scene.text;
  setup.command_line = a.command_line;
  setup.end_time = plan.end_time;
  setup.fps = scene.fps;
  setup.frames = scene.frames;
  setup.gauges = scene.gauges;
  setup.body_names = body_names;
  setup.threads = omp_get_max_threads();
  setup.quiet = a.common.quiet;
  return setup;
}

RunPlan run_plan(const SceneSpec& scene, const Arguments& a) {
  RunPlan plan{scene.end_time, scene.fps, a.until, scene.limits.step.value_or(0.0)};
  if (a.frames && *a.frames + 1 < frame_count(scene.end_time, scene.fps))
    plan.end_time = *a.frames * (1.0 / scene.fps);
  return plan;
}

// Logs what [expect] found; false when something is missed.
bool judge(const Expectations& expectations, RunWriter& writer) {
  bool good = true;
  for (const ExpectationResult& result : expectations.evaluate()) {
    writer.log(result.text);
    good = good && result.pass;
  }
  return good;
}

int finish_run(RunEnd end, bool whole, const Expectations& expectations,
               const Simulation& simulation, const Arguments& a, RunWriter& writer) {
  if (end == RunEnd::kStopped) {
    writer.finish(kExitStopped, interrupted ? "interrupted" : "stopped by --until", simulation);
    return kExitStopped;
  }
  if (!whole) {
    writer.finish_part(
        fmt::format("the first {} frames (--frames); the same command without it goes on",
                    *a.frames),
        simulation);
    return kExitDone;
  }
  const bool good = judge(expectations, writer);
  for (const ClosedForm& c : expectations.closed_forms())
    writer.add_closed_form({c.key, c.value, c.exact, c.size});
  const std::string reason = good ? "" : "the run missed what [expect] asks for";
  writer.finish(good ? kExitDone : kExitNumerics, reason, simulation);
  if (!good && a.common.quiet) log_error("error: " + reason);
  return good ? kExitDone : kExitNumerics;
}

// Everything that a run carries from step to step.
struct RunParts {
  Simulation simulation;
  Expectations expectations;
  LimitWatch limits;
  RunProgress progress;

  void visit_state(StateArchive& a) {
    simulation.visit_state(a);
    expectations.visit_state(a);
    limits.visit_state(a);
    progress.visit_state(a);
  }
};

RunEvents run_events(const SceneSpec& scene, RunParts& parts, RunWriter& writer,
                     const std::function<void()>& checkpoint) {
  RunEvents events;
  events.on_step = [&](const StepReport& report) {
    writer.on_step(report, parts.simulation);
    parts.expectations.observe(report, parts.simulation);
    parts.limits.observe(report, parts.simulation);
  };
  events.on_frame = [&, checkpoint] {
    writer.on_frame(parts.simulation);
    const int frame = writer.frame();
    if (scene.checkpoints && frame > 0 && frame % scene.checkpoint_every == 0) checkpoint();
  };
  events.stop_requested = [] { return interrupted != 0; };
  return events;
}

// Refuses (exit 5) a tank whose fields do not fit into what is free: the system would end the run,
// or others, when they are filled. Bodies and archetypes have their memory already.
void demand_memory_of_water(const SceneSpec& scene, const BuiltScene& built) {
  const Grid fields = field_grid(built.options, initial_fluid(scene.fluid));
  demand_memory(estimate_memory(built.options, fields, built.bodies).water,
                fmt::format("{}: water in {} cells", scene.file, fields.cells()),
                "coarsen it (fluid.grid, fluid.cell), take fewer particles, or raise the limit "
                "(ARCHETIDE_MEMORY_LIMIT, the job's, ulimit -v)");
}

// After the state of a checkpoint was read: the run goes on from there.
void resume(const RunStart& start, const RunProgress& progress, RunSetup& setup, RunPlan& plan) {
  setup.resumed = progress, setup.resumed_from = start.checkpoint;
  setup.fork = start.fork;
  plan.resumed = true;
  std::error_code ignored;
  fs::remove_all(fs::path(setup.directory) / "failure", ignored);
}

int run(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  ArchetypeLibrary library(scene.directory, a.archetypes);
  BuiltScene built = build_scene(scene, library);
  demand_memory_of_water(scene, built);
  const CheckpointIdentity identity = checkpoint_identity(scene.text, built.bodies, built.skins);
  RunPlan plan = run_plan(scene, a);
  RunSetup setup = run_setup(scene, plan, a, built.body_names);
  setup.notes = built.notes;
  const std::vector<std::string> joint_names = built.joint_names;
  const RunLock lock(a.out);
  const RunStart start = claim_run_folder(a, identity);

  RunParts parts{make_simulation(std::move(built), scene),
                 Expectations(scene.expect, scene.end_time),
                 LimitWatch(scene.limits),
                 {}};
  const auto visit = [&](StateArchive& state) { parts.visit_state(state); };
  if (!start.checkpoint.empty()) {
    read_state(start.checkpoint, identity, !start.fork, visit);
    resume(start, parts.progress, setup, plan);
  }
  stop_on_signals();  // before the manifest: who sees it may signal us
  RunWriter writer(setup, parts.simulation);
  const Checkpoints checkpoints(a.out, identity, scene.checkpoint_keep);
  const auto checkpoint = [&] {
    parts.progress = writer.progress();
    checkpoints.write(writer.frame(), visit);
  };
  try {
    const RunEnd end =
        run_frames(parts.simulation, plan, run_events(scene, parts, writer, checkpoint));
    const bool whole = plan.end_time == scene.end_time;
    if (end == RunEnd::kStopped) {
      parts.progress = writer.progress();
      checkpoints.write_stopped(visit);
    } else if (!whole || scene.checkpoints) {
      checkpoint();
    }
    return finish_run(end, whole, parts.expectations, parts.simulation, a, writer);
  } catch (const SimulationFailure& failure) {
    parts.progress = writer.progress();
    return finish_broken_run(failure,
                             failure_setup(scene, a, library, setup.body_names, joint_names),
                             identity, parts.simulation, visit, a.common.quiet, writer);
  }
}

}  // namespace

SimCommand run_command() {
  return {
      "run",
      "simulate a scene",
      {"run assets/scenes/tub.scene.toml -o out/runs/tub --set time.end=2.5",
       "run assets/scenes/tub.scene.toml -o out/runs/tub --until 1.0"},
      run,
      [](CLI::App& app, Arguments& a) {
        scene_options(app, a);
        app.add_option("-o,--output", a.out, "run folder")->required()->type_name("DIR");
        app.add_option("--resume", a.resume,
                       "auto (default): an unfinished run of this scene in DIR goes on | never | "
                       "FRAME: go on from that checkpoint | FILE.h5: from another run's state");
        app.add_option("--until", a.until,
                       "stop after the first step that reaches this scene time, s, with a "
                       "checkpoint and exit code 75")
            ->check(positive_number())
            ->type_name("T");
        app.add_option("--frames", a.frames,
                       "run only so many frames behind the initial state; without done.stamp, the "
                       "same command without --frames goes on")
            ->check(CLI::Range(1, 100'000'000))
            ->type_name("N");
        app.add_flag("--replace", a.replace,
                     "remove a run that is in the folder already (with --resume auto: one that "
                     "cannot go on)");
      }};
}

}  // namespace archetide
