#include "runtime/commands/command.h"

#include <fmt/core.h>
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

void frames_option(CLI::App& app, Arguments& a) {
  app.add_option("--frames", a.frame_range, "first and last frame (default: all)")
      ->type_name("A:B");
}

FrameRange frame_range(const Arguments& a) {
  const std::string& text = a.frame_range;
  if (text.empty()) return {};
  const std::size_t colon = text.find(':');
  const std::string first = text.substr(0, colon);
  const std::string last = colon == std::string::npos ? first : text.substr(colon + 1);
  const auto number = [&](const std::string& part, int fallback) {
    if (part.empty()) return fallback;
    if (part.size() > 8 || part.find_first_not_of("0123456789") != std::string::npos)
      throw InputError(fmt::format("--frames {} is no range of frames", text),
                       "expected a:b, for example 0:48");
    return std::stoi(part);
  };
  return {number(first, 0), number(last, -1)};
}

SceneSpec read_scene(const Arguments& a) { return parse_scene(a.scene, a.overrides); }

const std::vector<SimCommand>& commands() {
  static const std::vector<SimCommand> list = {
      run_command(),    check_command(),  deps_command(),  render_command(),
      report_command(), watch_command(),  bench_command(), diff_command(),
      export_command(), schema_command(), info_command(),  added_mass_command()};
  return list;
}

}  // namespace archetide
