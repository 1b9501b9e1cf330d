#pragma once

#include <string>
#include <vector>

#include "common/params/program.h"
#include "precompute/propose.h"
#include "precompute/recipe.h"

namespace archetide {

/// Everything that the command line of archetide-precompute can say, verb by verb.
struct BodyArguments {
  BodyArguments() { common.default_threads = 1; }  // more do not help below a million tets

  CommonOptions common;
  std::string command_line;
  std::string input;  // body file, archetype or mesh
  // build, check
  std::string output, depfile, defects;
  double time_limit = TetrahedralizeOptions().cpu_seconds;
  // info, schema
  bool json = false, markdown = false;
  // export
  int mode = 0;             // counted from 1; 0: rest shape
  double amplitude = -1.0;  // m; negative: a tenth of the body's size
  // report
  std::vector<std::string> archetypes;
  // propose
  std::string mesh_name;
  double scale = ProposeRequest().scale, density = ProposeRequest().density;
};

using BodyCommand = Command<BodyArguments>;

/// --time-limit, of the verbs that mesh a body.
void time_limit_option(CLI::App& verb, BodyArguments& a);
/// The body file, with the time limit in it. Throws InputError.
Recipe recipe_of(const BodyArguments& a);

BodyCommand build_body_command();
BodyCommand check_body_command();
BodyCommand info_command();
BodyCommand export_command();
BodyCommand report_bodies_command();
BodyCommand propose_command();
BodyCommand body_schema_command();

/// All of them, in the order of the help.
const std::vector<BodyCommand>& body_commands();

}  // namespace archetide
