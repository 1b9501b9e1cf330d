// One page about archetypes.

#include "precompute/inspect/report.h"

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include "common/archetype/skin.h"
#include "common/files/atomic_file.h"
#include "precompute/commands/command.h"

namespace archetide {
namespace {

int report(const BodyArguments& a) {
  make_folder_of(a.output);
  std::vector<std::string> bodies;
  for (const std::string& path : a.archetypes)
    if (is_skin_file(path))
      log_info(path + ": a skin, left out");
    else
      bodies.push_back(path);
  if (bodies.empty())
    throw InputError("there is nothing to report on: a skin has no tets and no modes",
                     "name the archetypes of its parts");
  write_archetype_report(a.output, bodies);
  log_info(fmt::format("{}: {} archetypes", a.output, bodies.size()));
  return kExitDone;
}

}  // namespace

BodyCommand report_bodies_command() {
  return {"report",
          "Write one page about archetypes: quality, mass, modes, pictures",
          {"report out/archetypes/torus.h5 -o torus.html",
           "report out/archetypes/torus.h5 out/archetypes/sphere.h5 -o bodies.html"},
          report,
          [](CLI::App& app, BodyArguments& a) {
            app.add_option("archetypes", a.archetypes, "archetypes, OUT.h5")
                ->required()
                ->type_name("OUT.h5");
            app.add_option("-o,--output", a.output, "page to write, report.html")
                ->required()
                ->type_name("F.html");
          }};
}

}  // namespace archetide
