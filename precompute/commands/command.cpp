#include "precompute/commands/command.h"

#include <CLI/CLI.hpp>

namespace archetide {

void time_limit_option(CLI::App& verb, BodyArguments& a) {
  verb.add_option("--time-limit", a.time_limit,
                  "refuse a surface that takes longer to check, repair and mesh, CPU seconds (and "
                  "2e-4 for each tet)")
      ->check(positive_number())
      ->type_name("S")
      ->capture_default_str();
}

Recipe recipe_of(const BodyArguments& a) {
  Recipe recipe = read_recipe(a.input);
  recipe.tet.cpu_seconds = a.time_limit;
  return recipe;
}

const std::vector<BodyCommand>& body_commands() {
  static const std::vector<BodyCommand> list = {
      build_body_command(),    check_body_command(), info_command(),       export_command(),
      report_bodies_command(), propose_command(),    body_schema_command()};
  return list;
}

}  // namespace archetide
