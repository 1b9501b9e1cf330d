// The command line of archetide-sim.

#include <CLI/CLI.hpp>

#include "common/base/keep_memory.h"
#include "common/params/cli.h"
#include "runtime/commands/command.h"

namespace archetide {
namespace {

// What stands below the options in the help of a verb.
std::string footer_of(const Command& verb) {
  return "-t, -v, -q, --log as in archetide-sim -h\n\n" + verb.examples + exit_code_help();
}

// The options of all verbs, for did-you-mean.
std::vector<std::string> known_options(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  for (const CLI::App* verb : app.get_subcommands({})) {
    for (const std::string& name : known_options(*verb)) names.push_back(name);
  }
  return names;
}

int program(int argc, char** argv) {
  Arguments a;
  CLI::App app("archetide-sim: reduced deformable bodies, two-way coupled with water",
               "archetide-sim");
  app.set_version_flag("--version", "archetide-sim " ARCHETIDE_VERSION);
  app.footer(examples_text({"run assets/scenes/tub.scene.toml -o out/runs/tub --set time.end=2.5",
                            "render out/runs/tub --size 1280x720"}) +
             exit_code_help());
  app.require_subcommand(1);
  app.option_defaults()->always_capture_default(false);
  add_common_options(app, a.common);
  std::vector<std::string> names;
  for (const Command& verb : commands()) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.purpose);
    verb.options(*sub, a);
    sub->fallthrough(!sub->get_allow_extras())->footer(footer_of(verb));
    names.push_back(verb.name);
  }
  for (int n = 0; n < argc; ++n) a.command_line += (n ? " " : "") + std::string(argv[n]);
  check_verb(argc, argv, names);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    throw command_line_error(error.what(), argc, argv, known_options(app));
  }
  apply_common_options(a.common);
  for (const Command& verb : commands()) {
    if (app.got_subcommand(verb.name)) return verb.execute(a);
  }
  return kExitInput;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  archetide::keep_freed_memory();
  return archetide::guarded_main([&] { return archetide::program(argc, argv); });
}
