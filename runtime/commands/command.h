#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/params/cli.h"
#include "runtime/scene/scene_spec.h"

namespace CLI {
class App;
}

namespace archetide {

/// Everything that the command line can say, verb by verb.
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

/// A verb of archetide-sim.
struct Command {
  std::string name, purpose;
  std::string examples;              // below the options in the help
  int (*execute)(const Arguments&);  // returns the exit code
  void (*options)(CLI::App&, Arguments&);
};

/// "Examples:" and a line for each; `examples`: words behind the program's name.
std::string examples_text(const std::vector<std::string>& examples);

/// Options of the verbs that read a scene.
void scene_options(CLI::App& app, Arguments& a);
SceneSpec read_scene(const Arguments& a);

Command run_command();
Command check_command();
Command deps_command();
Command render_command();
Command report_command();
Command bench_command();
Command diff_command();
Command schema_command();

/// All of them, in the order of the help.
const std::vector<Command>& commands();

}  // namespace archetide
