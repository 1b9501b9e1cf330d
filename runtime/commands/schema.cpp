// Prints every key of a scene file.

#include <CLI/CLI.hpp>
#include <iostream>

#include "runtime/commands/command.h"
#include "runtime/scene/scene_schema.h"

namespace archetide {
namespace {

int schema(const Arguments& a) {
  const Schema& keys = scene_schema();
  std::cout << (a.json ? keys.json() : a.markdown ? keys.markdown() : keys.text());
  return kExitDone;
}

}  // namespace

SimCommand schema_command() {
  return {"schema",
          "every key of a scene file: type, unit, range, default, meaning",
          {"schema", "schema --md"},
          schema,
          [](CLI::App& app, Arguments& a) {
            app.add_flag("--json", a.json, "as JSON");
            app.add_flag("--md", a.markdown, "as a Markdown table");
          }};
}

}  // namespace archetide
