// Reads a body file and meshes the body.

#include <CLI/CLI.hpp>
#include <iostream>

#include "precompute/build_skin.h"
#include "precompute/commands/command.h"
#include "precompute/commands/offenders.h"
#include "precompute/mesh_text.h"

namespace archetide {
namespace {

int check(const BodyArguments& a) {
  Profile profile;
  const Recipe recipe = recipe_of(a);
  const auto mesh = [&] { return mesh_body(recipe, profile); };
  if (recipe.skin)
    std::cout << skin_text(build_skin(recipe, profile), 0);
  else
    std::cout << mesh_text(recipe, a.defects.empty() ? mesh() : showing_offenders(a.defects, mesh));
  log_detail(phase_table(profile));
  return kExitDone;
}

}  // namespace

BodyCommand check_body_command() {
  return {
      "check",
      "Read and validate a body file, mesh it and report; no modes",
      {"check assets/bodies/torus.body.toml", "check duck.body.toml --defects duck.defects.ply"},
      check,
      [](CLI::App& app, BodyArguments& a) {
        app.add_option("body", a.input, "body file, NAME.body.toml")->required()->type_name("BODY");
        app.add_option("--defects", a.defects, "write the elements that are wrong to this PLY")
            ->type_name("F.ply");
        time_limit_option(app, a);
      }};
}

}  // namespace archetide
