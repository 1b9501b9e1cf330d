// Prints what a run folder holds.

#include <CLI/CLI.hpp>
#include <iostream>

#include "runtime/commands/command.h"
#include "runtime/output/run_info.h"

namespace archetide {
namespace {

int info(const Arguments& a) {
  if (a.directory.ends_with(".h5"))
    throw InputError(a.directory + " is no run folder",
                     "archetide-precompute info prints what an archetype holds");
  const RunFolder run = open_run_folder(a.directory);
  std::cout << (a.json ? run_info_json(run) : run_info_text(run));
  return kExitDone;
}

}  // namespace

SimCommand run_info_command() {
  return {"info",
          "what a run folder holds, and how far it is",
          {"info out/runs/tub", "info out/runs/tub --json"},
          info,
          [](CLI::App& app, Arguments& a) {
            app.add_option("run", a.directory, "run folder")->required()->type_name("RUN");
            app.add_flag("--json", a.json, "as JSON: manifest.json and what is on disk");
          }};
}

}  // namespace archetide
