// Prints what an archetype or a skin holds.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "common/archetype/archetype.h"
#include "precompute/build_skin.h"
#include "precompute/commands/command.h"
#include "precompute/inspect/inspect.h"

namespace archetide {
namespace {

int info(const BodyArguments& a) {
  const auto bytes = [&a] { return std::filesystem::file_size(a.input); };
  if (is_skin_file(a.input)) {
    const Skin skin = read_skin(a.input);
    std::cout << (a.json ? skin_json(skin, bytes()) : skin_text(skin, bytes()));
    return kExitDone;
  }
  const Archetype archetype = read_archetype(a.input);
  const std::optional<BuildRecord> record = read_record(a.input, archetype.content_hash);
  std::cout << (a.json ? info_json(archetype, bytes(), record)
                       : info_text(archetype, bytes(), record));
  return kExitDone;
}

}  // namespace

BodyCommand info_command() {
  return {
      "info",
      "Print what an archetype holds",
      {"info out/archetypes/torus.h5", "info out/archetypes/torus.h5 --json"},
      info,
      [](CLI::App& app, BodyArguments& a) {
        app.add_option("archetype", a.input, "archetype, OUT.h5")->required()->type_name("OUT.h5");
        app.add_flag("--json", a.json, "as JSON");
      }};
}

}  // namespace archetide
