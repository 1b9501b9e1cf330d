// Prints every key of a body file.

#include <CLI/CLI.hpp>
#include <iostream>

#include "precompute/commands/command.h"

namespace archetide {
namespace {

int schema(const BodyArguments& a) {
  const Schema& keys = body_schema();
  std::cout << (a.json ? keys.json() : a.markdown ? keys.markdown() : keys.text());
  return kExitDone;
}

}  // namespace

BodyCommand body_schema_command() {
  return {"schema",
          "List every key of a body file",
          {"schema", "schema --md"},
          schema,
          [](CLI::App& app, BodyArguments& a) {
            CLI::Option* json = app.add_flag("--json", a.json, "as JSON");
            app.add_flag("--md", a.markdown, "as Markdown")->excludes(json);
          }};
}

}  // namespace archetide
