#include "runtime/commands/command.h"

#include <CLI/CLI.hpp>

#include "runtime/scene/parse_scene.h"

namespace archetide {

void archetypes_option(CLI::App& app, Arguments& a) {
  app.add_option("--archetypes", a.archetypes,
                 "where NAME.h5 are (default: ARCHETIDE_ARCHETYPES, or out/archetypes)")
      ->type_name("DIR");
}

void scene_options(CLI::App& app, Arguments& a) {
  app.add_option("scene", a.scene, "scene file, *.scene.toml")->required()->type_name("SCENE");
  app.add_option("--set", a.overrides,
                 "override a key of the scene, may be repeated (key=absent takes it away)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  archetypes_option(app, a);
}

SceneSpec read_scene(const Arguments& a) { return parse_scene(a.scene, a.overrides); }

const std::vector<SimCommand>& commands() {
  static const std::vector<SimCommand> list = {
      run_command(),   check_command(), deps_command(),   render_command(),   report_command(),
      bench_command(), diff_command(),  schema_command(), run_info_command(), added_mass_command()};
  return list;
}

}  // namespace archetide
