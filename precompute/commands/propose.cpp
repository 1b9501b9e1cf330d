// Looks at a mesh and writes a body file that builds.

#include "precompute/propose.h"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "common/base/matter.h"
#include "common/files/atomic_file.h"
#include "precompute/commands/command.h"
#include "precompute/commands/stop_cleanly.h"

namespace archetide {
namespace {

/// The mesh as a body file beside `output` names it.
std::string mesh_name_of(const BodyArguments& a) {
  if (!a.mesh_name.empty()) return a.mesh_name;
  if (a.output.empty()) return a.input;
  const std::filesystem::path folder = std::filesystem::path(a.output).parent_path();
  return std::filesystem::proximate(a.input, folder.empty() ? "." : folder).string();
}

ProposeRequest request_of(const BodyArguments& a) {
  ProposeRequest request{a.input, mesh_name_of(a), a.output, a.scale, a.density, a.time_limit};
  if (a.output.empty())
    request.body = std::filesystem::path(a.input).replace_extension(".body.toml").string();
  return request;
}

/// Complains before the work, not after it.
void check_output(const std::string& output) {
  make_folder_of(output);
  if (std::filesystem::exists(std::filesystem::symlink_status(output)))
    throw InputError(output + " is there already", "remove it, or take another name");
  const AtomicFile writable(output);
}

constexpr char kProposeAgain[] =
    "\n  young depends on it: propose again with --scale (new-body: SCALE=)";

int propose(const BodyArguments& a) {
  if (!a.output.empty()) check_output(a.output);
  stop_cleanly(a.output);
  Profile profile;
  const Proposal proposal = propose_body(request_of(a), profile);
  if (!proposal.warning.empty()) log_warning(proposal.warning + kProposeAgain);
  log_detail(phase_table(profile));
  if (a.output.empty()) {
    log_info(proposal.summary);
    std::cout << proposal.text;
  } else {
    write_file_atomically(a.output, proposal.text);
    if (!a.common.quiet) std::cout << proposal.summary;
  }
  return kExitDone;
}

void propose_options(CLI::App& app, BodyArguments& a) {
  app.add_option("mesh", a.input, "surface or tets, of one closed solid")
      ->required()
      ->type_name("MESH");
  app.add_option("-o,--output", a.output,
                 "body file to write, NAME.body.toml, not there yet (default: stdout)")
      ->type_name("BODY");
  app.add_option("--scale", a.scale, "from mesh units to metres")
      ->check(positive_number())
      ->type_name("S")
      ->capture_default_str();
  app.add_option("--density", a.density, "kg/m^3; water has 1000")
      ->check(positive_number())
      ->check(CLI::Range(kLeastDensity, kLargestDensity))
      ->type_name("D")
      ->capture_default_str();
  app.add_option("--mesh-name", a.mesh_name,
                 "what the body file calls the mesh (default: its path from there)")
      ->type_name("NAME");
  time_limit_option(app, a);
}

}  // namespace

BodyCommand propose_command() {
  return {"propose",
          "Look at a mesh and write a body file that builds",
          {"propose duck.obj -o duck.body.toml",
           "propose duck.obj --scale 0.01 --density 1000 >duck.body.toml"},
          propose,
          propose_options};
}

}  // namespace archetide
