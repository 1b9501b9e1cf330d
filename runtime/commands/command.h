#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/params/program.h"
#include "runtime/scene/scene_spec.h"

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
  int every = 10;  // watch: frames
  double tolerance = 0.0;
  // bench
  std::vector<std::string> sweeps, references;
  std::string csv;
  // schema
  bool json = false, markdown = false;
  // added-mass
  std::string body;
  double cell = 0.0, density = 1000.0;           // m, kg/m^3
  std::vector<double> tank, position, rotation;  // three numbers or none: m, m, degrees
  bool walls = false;
  std::optional<double> level;  // m
  std::optional<int> modes;
};

using SimCommand = Command<Arguments>;

/// --archetypes, of the verbs that read bodies.
void archetypes_option(CLI::App& app, Arguments& a);
/// Options of the verbs that read a scene.
void scene_options(CLI::App& app, Arguments& a);
SceneSpec read_scene(const Arguments& a);

/// --frames A:B.
void frames_option(CLI::App& app, Arguments& a);
struct FrameRange {
  int first = 0, last = -1;  // inclusive; last < 0: to the end
};
/// Of "a:b", "a:", ":b" or "a". Throws InputError.
FrameRange frame_range(const Arguments& a);

SimCommand run_command();
SimCommand check_command();
SimCommand deps_command();
SimCommand render_command();
SimCommand report_command();
SimCommand bench_command();
SimCommand diff_command();
SimCommand schema_command();
SimCommand export_command();
SimCommand watch_command();
SimCommand info_command();
SimCommand added_mass_command();

/// All of them, in the order of the help.
const std::vector<SimCommand>& commands();

}  // namespace archetide
