#include <omp.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <filesystem>
#include <iostream>

#include "common/atomic_file.h"
#include "common/cli.h"
#include "common/keep_memory.h"
#include "common/make_word.h"
#include "common/memory.h"
#include "runtime/bench/bench.h"
#include "runtime/output/checkpoint.h"
#include "runtime/output/csv.h"
#include "runtime/output/failure_folder.h"
#include "runtime/output/number_text.h"
#include "runtime/output/render.h"
#include "runtime/output/report.h"
#include "runtime/output/run_description.h"
#include "runtime/output/run_lock.h"
#include "runtime/output/run_writer.h"
#include "runtime/scene/expectations.h"
#include "runtime/scene/initial_water.h"
#include "runtime/scene/limits.h"
#include "runtime/scene/parse_scene.h"
#include "runtime/scene/run_loop.h"
#include "runtime/scene/scene_builder.h"
#include "runtime/scene/scene_schema.h"
#include "runtime/water_step.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

// Everything that the command line can say, verb by verb.
struct Arguments {
  CommonOptions common;
  std::string command_line;
  // run, check, deps
  std::string scene, archetypes, out, target;
  std::vector<std::string> overrides;
  std::string resume;  // "": auto
  std::optional<double> until;
  std::optional<int> frames;
  bool replace = false;
  // render, report, diff
  std::string directory, other_directory, frame_range, size = "1280x720";
  std::vector<std::string> directories;
  bool no_film = false;
  double tolerance = 0.0;
  // bench
  std::vector<std::string> sweeps, references;
  std::string csv;
  // schema
  bool json = false, markdown = false;
};

volatile std::sig_atomic_t interrupted = 0;
extern "C" void on_interrupt(int) { interrupted = 1; }

// From here on signals that ask for an end let the step be finished. A terminal or a pipe that is
// gone takes only what is shown there.
void stop_on_signals() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // nohup
  std::signal(SIGPIPE, SIG_IGN);
}

SceneSpec read_scene(const Arguments& a) { return parse_scene(a.scene, a.overrides); }

// --- run ---

// Where a run begins: at the start, in the middle of the run that is in the folder, or at a
// checkpoint of another one.
struct RunStart {
  std::string checkpoint;  // "": at the start
  bool fork = false;
};

bool is_frame(const std::string& text) {
  return !text.empty() && text.size() <= 9 &&
         text.find_first_not_of("0123456789") == std::string::npos;
}

void clear_run_folder(const std::string& folder) {
  for (const char* name :
       {"done.stamp", "scene.toml", "run.log", "stats.csv", "bodies.csv", "frames", "pictures",
        "failure", "checkpoint", "film.mp4", "report.html", "manifest.json"}) {
    fs::remove_all(fs::path(folder) / name);
  }
}

// True when the folder holds a run. Throws InputError when it holds anything else. A run begins
// with its manifest: one that was killed before has left nothing but that file's part.
bool holds_run(const std::string& out) {
  if (fs::exists(fs::path(out) / "manifest.json")) return true;
  for (const fs::directory_entry& entry : fs::directory_iterator(out)) {
    if (entry.path().filename() != "manifest.json.part")
      throw InputError(out + " holds files that are no run of this program",
                       "choose another -o DIR");
  }
  return false;
}

// `auto` in a folder with a run: an unfinished one of this scene goes on.
RunStart resume_automatically(const Arguments& a, const CheckpointIdentity& identity) {
  const bool done = fs::exists(fs::path(a.out) / "done.stamp");
  const bool either = a.replace && !a.resume.empty();  // both given: resume where possible
  const auto latest = done || (a.replace && !either) ? std::nullopt : latest_checkpoint(a.out);
  if (latest && (!either || state_fits(*latest, identity))) return {*latest, false};
  if (!a.replace)
    throw InputError(
        a.out + (done ? " holds a run already" : " holds an unfinished run without a checkpoint"),
        "use --replace to run again in its place");
  clear_run_folder(a.out);
  return {};
}

RunStart claim_run_folder(const Arguments& a, const CheckpointIdentity& identity) {
  const bool automatic = a.resume.empty() || a.resume == "auto", fork = a.resume.ends_with(".h5");
  if (!automatic && !fork && a.resume != "never" && !is_frame(a.resume))
    throw InputError("--resume " + a.resume + " is neither auto, never, a frame nor a file .h5",
                     "for example --resume 144");
  const bool held = holds_run(a.out);
  if (is_frame(a.resume)) return {checkpoint_of_frame(a.out, std::stoi(a.resume)), false};
  if (held && automatic) return resume_automatically(a, identity);
  if (held && !a.replace)
    throw InputError(a.out + " holds a run already", "use --replace to run again in its place");
  if (held) clear_run_folder(a.out);
  return fork ? RunStart{a.resume, true} : RunStart{};
}

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

// The scene with paths that hold from anywhere.
std::string portable_scene(const SceneSpec& scene) {
  std::vector<std::string> paths;
  const auto fix = [&](const std::string& key, const std::string& path) {
    if (!path.empty()) paths.push_back(key + "=\"" + fs::absolute(path).string() + "\"");
  };
  for (std::size_t n = 0; n < scene.statics.size(); ++n)
    fix("static[" + std::to_string(n) + "].mesh", scene.statics[n].mesh);
  if (scene.fluid) fix("fluid.water.mesh", scene.fluid->water.mesh);
  const auto fix_archetype = [&](const std::string& list, std::size_t n, const std::string& name) {
    if (name.ends_with(".h5")) fix(list + "[" + std::to_string(n) + "].archetype", name);
  };
  for (std::size_t n = 0; n < scene.bodies.size(); ++n)
    fix_archetype("body", n, scene.bodies[n].archetype);
  for (std::size_t n = 0; n < scene.scatters.size(); ++n)
    fix_archetype("scatter", n, scene.scatters[n].body.archetype);
  for (std::size_t n = 0; n < scene.skins.size(); ++n)
    fix_archetype("skin", n, scene.skins[n].archetype);
  return paths.empty() ? scene.text : parse_scene_text(scene.text, scene.file, paths).text;
}

FailureSetup failure_setup(const SceneSpec& scene, const Arguments& a,
                           const ArchetypeLibrary& library,
                           const std::vector<std::string>& body_names,
                           const std::vector<std::string>& joint_names) {
  FailureSetup setup{a.out, portable_scene(scene), "", body_names, joint_names};
  for (const std::string& name : archetype_names(scene)) {
    if (name.ends_with(".h5")) continue;
    const fs::path folder = fs::absolute(library.path(name)).parent_path();
    setup.options = " --archetypes '" + folder.lexically_normal().string() + "'";
  }
  if (a.frames) setup.options += " --frames " + std::to_string(*a.frames);
  setup.options += " -t " + std::to_string(omp_get_max_threads());
  return setup;
}

int finish_broken_run(const SimulationFailure& failure, const FailureSetup& setup,
                      const CheckpointIdentity& identity, const Simulation& simulation,
                      const VisitState& visit, bool quiet, RunWriter& writer) {
  const std::string replay = write_failure(setup, failure, identity, simulation, visit);
  const std::string names = culprit_names(failure.culprit, setup);
  const std::string reason = failure.what() + (names.empty() ? "" : ": " + names);
  writer.finish(kExitNumerics, reason, simulation);
  writer.log("see " + setup.run_folder + "/failure; replay: " + replay);
  if (quiet) log_error("error: " + reason);
  return kExitNumerics;
}

int finish_run(RunEnd end, bool whole, const Expectations& expectations,
               const Simulation& simulation, const Arguments& a, RunWriter& writer) {
  if (end == RunEnd::kStopped) {
    writer.finish(kExitStopped, interrupted ? "interrupted" : "stopped by --until", simulation);
    return kExitStopped;
  }
  if (!whole) {
    writer.finish_part("the first " + std::to_string(*a.frames) +
                           " frames (--frames); the same command without it goes on",
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
                scene.file + ": water in " + std::to_string(fields.cells()) + " cells",
                "coarsen it (fluid.grid, fluid.cell), take fewer particles, or raise the limit "
                "(ARCHETIDE_MEMORY_LIMIT, the job's, ulimit -v)");
}

int run(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  ArchetypeLibrary library(scene.directory, a.archetypes);
  BuiltScene built = build_scene(scene, library);
  demand_memory_of_water(scene, built);
  const CheckpointIdentity identity = checkpoint_identity(scene.text, built.bodies, built.skins);
  RunPlan plan = run_plan(scene, a);
  RunSetup setup = run_setup(scene, plan, a, built.body_names);
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
    setup.resumed = parts.progress, setup.resumed_from = start.checkpoint;
    setup.fork = start.fork;
    plan.resumed = true;
    std::error_code ignored;
    fs::remove_all(fs::path(a.out) / "failure", ignored);
  }
  RunWriter writer(setup, parts.simulation);
  const Checkpoints checkpoints(a.out, identity, scene.checkpoint_keep);
  const auto checkpoint = [&] {
    parts.progress = writer.progress();
    checkpoints.write(writer.frame(), visit);
  };
  stop_on_signals();
  try {
    const RunEnd end =
        run_frames(parts.simulation, plan, run_events(scene, parts, writer, checkpoint));
    const bool whole = plan.end_time == scene.end_time;
    if (end == RunEnd::kStopped || !whole || scene.checkpoints) checkpoint();
    return finish_run(end, whole, parts.expectations, parts.simulation, a, writer);
  } catch (const SimulationFailure& failure) {
    parts.progress = writer.progress();
    return finish_broken_run(failure,
                             failure_setup(scene, a, library, setup.body_names, joint_names),
                             identity, parts.simulation, visit, a.common.quiet, writer);
  }
}

// --- check, deps ---

int check(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  ArchetypeLibrary library(scene.directory, a.archetypes);
  const BuiltScene built = build_scene(scene, library);
  const SimulationOptions& o = built.options;
  const Grid fields = field_grid(o, initial_fluid(scene.fluid));
  const MemoryEstimate memory = estimate_memory(o, fields, built.bodies);
  const auto line = [](const std::string& name, const auto& value) {
    std::cout << std::left << std::setw(14) << name << value << '\n';
  };
  line("scene", scene.name + " (" + scene.file + ")");
  line("time", std::to_string(scene.end_time) + " s, " +
                   std::to_string(frame_count(scene.end_time, scene.fps)) + " frames");
  line("cells", std::to_string(o.grid.cells()) + " (" + std::to_string(o.grid.nx) + " x " +
                    std::to_string(o.grid.ny) + " x " + std::to_string(o.grid.nz) + ")");
  line("water", !o.has_water              ? "none"
                : scene.fluid->water.full ? "the tank is full, no free surface"
                                          : "free surface");
  if (fields.nz < o.grid.nz)
    line("fields",
         "the lowest " + std::to_string(fields.nz) + " layers, as far as the water needs");
  line("particles", o.particles_per_cell ? std::to_string(o.particles_per_cell) + " per cell" +
                                               (o.spray ? ", spray" : "")
                                         : "none");
  line("damping", damping_text(o.damping));
  line("geometry", o.geometry == Geometry::kCutCell ? "cut-cell" : "voxel");
  line("scheme", o.scheme == Scheme::kNewmark ? "newmark (two solves)" : "single");
  line("bodies", built.bodies.size());
  for (std::size_t b = 0; b < built.bodies.size(); ++b) {
    const ReducedBody& body = built.bodies[b];
    log_detail("  body " + std::to_string(b) + " " + built.body_names[b] + ": " +
               std::to_string(body.archetype->integrals.mass * body.mass_scale) + " kg, " +
               std::to_string(body.r) + " modes");
  }
  line("joints", built.joints.size());
  line("skins", built.skins.size());
  line("obstacles", built.obstacles.size());
  int markers = 0;
  for (const MarkersSpec& spec : scene.markers) markers += spec.count;
  line("actuators", built.actuators.size());
  line("markers", markers);
  line("checkpoints", scene.checkpoints
                          ? "every " + std::to_string(scene.checkpoint_every) + " frames"
                          : "when it is stopped");
  line("memory", bytes_text(memory.total()) + " (water " + bytes_text(memory.water) + ", bodies " +
                     bytes_text(memory.bodies) + ", archetypes " + bytes_text(memory.archetypes) +
                     ")");
  return kExitDone;
}

int deps(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  const ArchetypeLibrary library(scene.directory, a.archetypes);
  write_file_atomically(a.out, make_fragment(a.target, scene_dependencies(scene, library)));
  return kExitDone;
}

// --- render, report ---

// "a:b", "a:", ":b" or "a".
void parse_frame_range(const std::string& text, RenderOptions& options) {
  const std::size_t colon = text.find(':');
  const std::string first = text.substr(0, colon);
  const std::string last = colon == std::string::npos ? first : text.substr(colon + 1);
  const auto number = [&](const std::string& part, int fallback) {
    if (part.empty()) return fallback;
    if (part.size() > 8 || part.find_first_not_of("0123456789") != std::string::npos) {
      throw InputError("--frames " + text + " is no range of frames",
                       "expected a:b, for example 0:48");
    }
    return std::stoi(part);
  };
  options.first_frame = number(first, 0);
  options.last_frame = number(last, -1);
}

void parse_size(const std::string& text, RenderOptions& options) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &options.width, &options.height, &end) != 2) {
    throw InputError("--size " + text + " is no size", "expected WIDTHxHEIGHT in pixels, 1280x720");
  }
}

int render(const Arguments& a) {
  RenderOptions options;
  if (!a.frame_range.empty()) parse_frame_range(a.frame_range, options);
  parse_size(a.size, options);
  options.film = !a.no_film;
  options.quiet = a.common.quiet;
  const RenderSummary summary = render_run(a.directory, options);
  log_info(std::to_string(summary.frames) + " pictures, " +
           std::to_string(summary.seconds_per_frame) + " s each" +
           (summary.film.empty() ? ", no film" : ", film " + summary.film));
  return kExitDone;
}

int report(const Arguments& a) {
  make_folder_of(a.out);
  write_report(a.directories, a.out);
  return kExitDone;
}

// --- diff ---

bool same_rows(const std::string& file, const CsvTable& a, const CsvTable& b) {
  const std::size_t rows_a = a.columns.empty() ? 0 : a.columns[0].size();
  const std::size_t rows_b = b.columns.empty() ? 0 : b.columns[0].size();
  if (rows_a == rows_b && a.names == b.names) return true;
  std::cout << file << ": " << rows_a << " rows of " << a.names.size() << " columns against "
            << rows_b << " rows of " << b.names.size() << '\n';
  return false;
}

// |a - b| <= tolerance * largest magnitude in the column; wall clocks are not compared.
bool same_column(const std::string& file, const std::string& name, const std::vector<double>& a,
                 const std::vector<double>& b, double tolerance) {
  double scale = 0.0, worst = 0.0;
  std::size_t worst_row = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (std::isnan(a[n]) && std::isnan(b[n])) continue;
    scale = std::max({scale, std::abs(a[n]), std::abs(b[n])});
    const double difference = std::abs(a[n] - b[n]);
    if (!(difference <= worst)) worst = difference, worst_row = n;
  }
  if (worst <= tolerance * scale) return true;
  std::cout << file << ": " << name << " differs by " << worst << " (" << worst / scale
            << " of its largest value), row " << worst_row + 2 << '\n';
  return false;
}

bool same_table(const std::string& file, const Arguments& a) {
  const CsvTable first = read_csv(a.directory + "/" + file);
  const CsvTable second = read_csv(a.other_directory + "/" + file);
  if (!same_rows(file, first, second)) return false;
  bool same = true;
  for (std::size_t c = 0; c < first.names.size(); ++c) {
    if (first.names[c].find("seconds") != std::string::npos) continue;
    same =
        same_column(file, first.names[c], first.columns[c], second.columns[c], a.tolerance) && same;
  }
  return same;
}

int diff(const Arguments& a) {
  const bool stats = same_table("stats.csv", a), bodies = same_table("bodies.csv", a);
  if (stats && bodies) std::cout << "the same within " << a.tolerance << '\n';
  return stats && bodies ? kExitDone : kExitNumerics;
}

// --- bench, schema ---

int bench(const Arguments& a) {
  BenchRequest request;
  request.program = std::filesystem::read_symlink("/proc/self/exe").string();
  request.scene = a.scene, request.archetypes = a.archetypes;
  request.overrides = a.overrides, request.sweeps = a.sweeps, request.references = a.references;
  request.csv = a.csv, request.until = a.until;
  request.threads = a.common.threads;
  request.out = a.out.empty() ? "out/bench/" + read_scene(a).name : a.out;
  stop_on_signals();
  const BenchTable table = run_bench(request, interrupted);
  std::cout << bench_text(table);
  if (interrupted) return kExitStopped;
  const bool failed = std::any_of(table.rows.begin(), table.rows.end(),
                                  [](const BenchRow& row) { return row.failed; });
  if (failed) log_error("error: a point failed; its row says how");
  return failed ? kExitNumerics : kExitDone;
}

int schema(const Arguments& a) {
  const Schema& keys = scene_schema();
  std::cout << (a.json ? keys.json() : a.markdown ? keys.markdown() : keys.text());
  return kExitDone;
}

// --- command line ---

struct Verb {
  std::string name, purpose;
  std::vector<std::string> examples;  // words behind the program's name
  int (*execute)(const Arguments&);
  void (*options)(CLI::App&, Arguments&);
};

void scene_options(CLI::App& app, Arguments& a) {
  app.add_option("scene", a.scene, "scene file, *.scene.toml")->required()->type_name("SCENE");
  app.add_option("--set", a.overrides,
                 "override a key of the scene, may be repeated (key=absent takes it away)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--archetypes", a.archetypes,
                 "where NAME.h5 are (default: ARCHETIDE_ARCHETYPES, or out/archetypes)")
      ->type_name("DIR");
}

const std::vector<Verb>& verbs() {
  static const std::vector<Verb> list = {
      {"run",
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
       }},
      {"check",
       "validate a scene, list what is on, estimate cells and memory",
       {"check assets/scenes/tub.scene.toml", "check assets/scenes/tub.scene.toml -v"},
       check,
       scene_options},
      {"deps",
       "write the files that a run reads as a make fragment",
       {"deps assets/scenes/tub.scene.toml -o out/.state/tub.d out/runs/tub/done.stamp"},
       deps,
       [](CLI::App& app, Arguments& a) {
         scene_options(app, a);
         app.add_option("-o,--output", a.out, "the fragment")->required()->type_name("F");
         app.add_option("target", a.target, "what depends on them")
             ->required()
             ->type_name("TARGET");
       }},
      {"render",
       "a PNG per frame, and a film when ffmpeg is there",
       {"render out/runs/tub --size 1280x720", "render out/runs/tub --frames 24:48 --no-film"},
       render,
       [](CLI::App& app, Arguments& a) {
         app.add_option("dir", a.directory, "run folder")->required()->type_name("DIR");
         app.add_option("--frames", a.frame_range, "first and last frame (default: all)")
             ->type_name("A:B");
         app.add_option("--size", a.size, "pixels")->type_name("WxH")->capture_default_str();
         app.add_flag("--no-film", a.no_film, "pictures only");
       }},
      {"report",
       "one self-contained HTML page about runs, sweeps and scorecards",
       {"report out/runs/tub -o out/report.html",
        "report out/runs/tub out/bench/tub out/scorecard.csv -o out/report.html"},
       report,
       [](CLI::App& app, Arguments& a) {
         app.add_option("dirs", a.directories,
                        "run folders, folders of bench, their CSV files, scorecard.csv")
             ->required()
             ->type_name("DIR");
         app.add_option("-o,--output", a.out, "the page")->required()->type_name("FILE");
       }},
      {"bench",
       "sweep keys of a scene: error beside CPU seconds of every point",
       {},  // in bench_help()
       bench,
       [](CLI::App& app, Arguments& a) {
         scene_options(app, a);
         app.add_option("--sweep", a.sweeps,
                        "values of one key, may be repeated (the product is run); a value with "
                        "commas stands in [brackets]")
             ->required()
             ->type_name("KEY=V1,V2,...")
             ->allow_extra_args(false);
         app.add_option("--reference", a.references,
                        "what errors are measured from: a value of the first key, KEY=VALUE of any "
                        "swept key (may be repeated), or the folder of a finished run (default: "
                        "closed forms of [expect], else the last value of every key)")
             ->type_name("V|KEY=V|DIR")
             ->allow_extra_args(false);
         app.add_option("--csv", a.csv, "another copy of the table")->type_name("F");
         app.add_option("-o,--output", a.out, "folder of the runs (default: out/bench/NAME)")
             ->type_name("DIR");
         app.add_option("--until", a.until, "stop every run at this scene time, s")
             ->check(positive_number())
             ->type_name("T");
       }},
      {"diff",
       "compare states and statistics of two runs",
       {"diff out/runs/tub out/runs/tub_resumed", "diff out/runs/tub out/runs/other --tol 1e-6"},
       diff,
       [](CLI::App& app, Arguments& a) {
         app.add_option("dir_a", a.directory, "run folder")->required()->type_name("DIR_A");
         app.add_option("dir_b", a.other_directory, "run folder")->required()->type_name("DIR_B");
         app.add_option("--tol", a.tolerance,
                        "allowed difference relative to a column's largest value")
             ->check(non_negative_number())
             ->type_name("T")
             ->capture_default_str();
       }},
      {"schema",
       "every key of a scene file: type, unit, range, default, meaning",
       {"schema", "schema --md"},
       schema,
       [](CLI::App& app, Arguments& a) {
         app.add_flag("--json", a.json, "as JSON");
         app.add_flag("--md", a.markdown, "as a Markdown table");
       }}};
  return list;
}

std::string examples_text(const std::vector<std::string>& examples) {
  std::string text = "Examples:\n";
  for (const std::string& words : examples) text += "  archetide-sim " + words + '\n';
  return text + '\n';
}

// What stands below the options in the help of a verb.
std::string footer_of(const Verb& verb) {
  const std::string examples = verb.name == "bench" ? bench_help() : examples_text(verb.examples);
  return "-t, -v, -q, --log as in archetide-sim -h\n\n" + examples + exit_code_help();
}

// The options of all verbs, for did-you-mean.
std::vector<std::string> known_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  for (const CLI::App* verb : app.get_subcommands({})) {
    for (const std::string& name : known_options(*verb)) names.push_back(name);
  }
  return names;
}

int program(int argc, char** argv) {
  Arguments a;
  CLI::App app("archetide-sim: reduced deformable bodies, two-way coupled with water",
               "archetide-sim");
  app.set_version_flag("--version", "archetide-sim " ARCHETIDE_VERSION);
  app.footer(examples_text({"run assets/scenes/tub.scene.toml -o out/runs/tub --set time.end=2.5",
                            "render out/runs/tub --size 1280x720"}) +
             exit_code_help());
  app.require_subcommand(1);
  app.option_defaults()->always_capture_default(false);
  add_common_options(app, a.common);
  std::vector<std::string> names;
  for (const Verb& verb : verbs()) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.purpose);
    verb.options(*sub, a);
    sub->fallthrough(!sub->get_allow_extras())->footer(footer_of(verb));
    names.push_back(verb.name);
  }
  for (int n = 0; n < argc; ++n) a.command_line += (n ? " " : "") + std::string(argv[n]);
  check_verb(argc, argv, names);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    throw command_line_error(error.what(), argc, argv, known_options(app));
  }
  apply_common_options(a.common);
  for (const Verb& verb : verbs()) {
    if (app.got_subcommand(verb.name)) return verb.execute(a);
  }
  return kExitInput;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  archetide::keep_freed_memory();
  return archetide::guarded_main([&] { return archetide::program(argc, argv); });
}
