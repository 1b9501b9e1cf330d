#include "common/params/program.h"

#include <CLI/CLI.hpp>

namespace archetide {
namespace {

std::string examples_text(const std::string& program, const std::vector<std::string>& examples) {
  std::string text = "Examples:\n";
  for (const std::string& words : examples) text += "  " + program + " " + words + '\n';
  return text + '\n';
}

// The options of a parser and of all its verbs, with their dashes.
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

// -t, -v, -q, --log.
void add_common_options(CLI::App& app, CommonOptions& options) {
  const std::string threads =
      options.default_threads > 0 ? std::to_string(options.default_threads) : "all cores";
  app.add_option("-t,--threads", options.threads,
                 "threads, 1..1024 (default: ARCHETIDE_THREADS, or " + threads + ")")
      ->type_name("N");
  app.add_flag("-v,--verbose", options.verbose, "say more");
  app.add_flag("-q,--quiet", options.quiet, "say nothing but warnings and errors");
  app.add_option("--log", options.log_file, "copy the log into FILE")->type_name("FILE");
}

}  // namespace

int run_program(const Program& program, const std::vector<Verb>& verbs, CommonOptions& common,
                int argc, char** argv) {
  CLI::App app(program.name + ": " + program.purpose, program.name);
  app.set_version_flag("--version", program.name + " " ARCHETIDE_VERSION);
  const std::string below = exit_code_help() + program.notes;
  app.footer(examples_text(program.name, program.examples) + below);
  app.require_subcommand(1);
  app.option_defaults()->always_capture_default(false);
  add_common_options(app, common);
  std::vector<std::string> names;
  for (const Verb& verb : verbs) {
    CLI::App* sub = app.add_subcommand(verb.name, verb.purpose);
    verb.options(*sub);
    sub->fallthrough(!sub->get_allow_extras())
        ->footer("-t, -v, -q, --log as in " + program.name + " -h\n\n" + verb.explanation +
                 examples_text(program.name, verb.examples) + below);
    names.push_back(verb.name);
  }
  check_verb(argc, argv, names);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& answered) {
    return app.exit(answered);
  } catch (const CLI::ParseError& error) {
    throw command_line_error(error.what(), argc, argv, known_options(app));
  }
  apply_common_options(common);
  for (const Verb& verb : verbs) {
    if (app.got_subcommand(verb.name)) return verb.execute();
  }
  return kExitInput;
}

}  // namespace archetide
