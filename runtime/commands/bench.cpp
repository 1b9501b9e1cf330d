// Sweeps keys of a scene.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "runtime/bench/bench.h"
#include "runtime/commands/command.h"
#include "runtime/commands/interrupt.h"

namespace archetide {
namespace {

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

}  // namespace

SimCommand bench_command() {
  return {"bench",
          "sweep keys of a scene: error beside CPU seconds of every point",
          {"bench assets/scenes/tub.scene.toml --until 1 --sweep fluid.cell=1/32,1/64,1/96 \\\n"
           "    --sweep coupling.geometry=cut-cell,voxel -o out/bench/tub",
           "bench assets/scenes/tub.scene.toml --sweep body.modes=0,2,5,10 --reference 10"},
          bench,
          [](CLI::App& app, Arguments& a) {
            scene_options(app, a);
            app.add_option("--sweep", a.sweeps,
                           "values of one key, may be repeated (the product is run); a value with "
                           "commas stands in [brackets]")
                ->required()
                ->type_name("KEY=V1,V2,...")
                ->allow_extra_args(false);
            app.add_option(
                   "--reference", a.references,
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
          },
          bench_help()};
}

}  // namespace archetide
