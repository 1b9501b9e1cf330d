#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/params/cli.h"

namespace CLI {
class App;
}

namespace archetide {

/// A verb of a program. Arguments: all that its command line can say, with `CommonOptions common`
/// and `std::string command_line` among it.
template <class Arguments>
struct Command {
  std::string name, purpose;
  std::vector<std::string> examples;  // words behind the program's name
  int (*execute)(const Arguments&);   // returns the exit code
  void (*options)(CLI::App&, Arguments&);
  std::string explanation = {};  // above the examples in the help, may be empty
};

/// A verb with its arguments at hand.
struct Verb {
  std::string name, purpose, explanation;
  std::vector<std::string> examples;
  std::function<void(CLI::App&)> options;
  std::function<int()> execute;
};

/// What a program is, and what its help says above and below its verbs.
struct Program {
  std::string name, purpose;
  std::vector<std::string> examples;  // words behind the program's name
  std::string notes;                  // below the exit codes, may be empty
};

/// Reads the command line into the arguments that the options of the verbs know, and executes its
/// verb; returns the exit code. Throws InputError for what the command line should not say, and
/// what the verb throws.
int run_program(const Program& program, const std::vector<Verb>& verbs, CommonOptions& common,
                int argc, char** argv);

template <class Arguments>
int run_program(const Program& program, const std::vector<Command<Arguments>>& commands, int argc,
                char** argv) {
  Arguments a;
  for (int n = 0; n < argc; ++n) a.command_line += (n ? " " : "") + std::string(argv[n]);
  std::vector<Verb> verbs;
  for (const Command<Arguments>& c : commands) {
    verbs.push_back({c.name, c.purpose, c.explanation, c.examples,
                     [&](CLI::App& verb) { c.options(verb, a); }, [&] { return c.execute(a); }});
  }
  return run_program(program, verbs, a.common, argc, argv);
}

}  // namespace archetide
