#include <fmt/core.h>
#include <omp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <new>
#include <string_view>

#include "common/archetype/archetype.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "common/base/keep_memory.h"
#include "common/base/matter.h"
#include "common/files/atomic_file.h"
#include "common/params/cli.h"
#include "precompute/base/defects.h"
#include "precompute/build.h"
#include "precompute/build_skin.h"
#include "precompute/inspect/inspect.h"
#include "precompute/inspect/report.h"
#include "precompute/mesh_text.h"
#include "precompute/propose.h"

namespace archetide {
namespace {

struct CommandLine {
  std::string input, output, depfile, defects, log_file, mesh_name;
  std::vector<std::string> archetypes;
  int threads = 1;
  double time_limit = TetrahedralizeOptions().cpu_seconds;
  double scale = ProposeRequest().scale, density = ProposeRequest().density;
  int mode = 0;
  double amplitude = -1.0;  // m; negative: a tenth of the body's size
  bool verbose = false, quiet = false, json = false, markdown = false;
};

constexpr char kExitCodes[] =
    "\nExit codes:\n"
    "  0 done   1 our bug   2 your input (command line, body file, mesh)   3 the numbers (quality, "
    "residual)\n"
    "  4 a file is missing, damaged or of another version   5 the machine (disk, memory)\n"
    "  75 stopped by SIGINT or SIGTERM; an older OUT.h5 stays as it was\n"
    "ARCHETIDE_MEMORY_LIMIT=4G refuses (exit 5) what would take more memory than that.\n";

/// Two examples of a verb ("": of the program), for its help.
std::string examples_of(const std::string& verb) {
  static const std::map<std::string, std::vector<std::string>> kExamples = {
      {"",
       {"build assets/bodies/torus.body.toml -o out/archetypes/torus.h5",
        "info out/archetypes/torus.h5 --json"}},
      {"build",
       {"build assets/bodies/torus.body.toml -o out/archetypes/torus.h5",
        "build duck.body.toml -o duck.h5 --depfile duck.h5.d --time-limit 120"}},
      {"check",
       {"check assets/bodies/torus.body.toml", "check duck.body.toml --defects duck.defects.ply"}},
      {"info", {"info out/archetypes/torus.h5", "info out/archetypes/torus.h5 --json"}},
      {"export",
       {"export out/archetypes/torus.h5 -o torus.hdf",
        "export out/archetypes/torus.h5 --mode 1 -o torus1.vtu"}},
      {"report",
       {"report out/archetypes/torus.h5 -o torus.html",
        "report out/archetypes/torus.h5 out/archetypes/sphere.h5 -o bodies.html"}},
      {"propose",
       {"propose duck.obj -o duck.body.toml",
        "propose duck.obj --scale 0.01 --density 1000 >duck.body.toml"}},
      {"schema", {"schema", "schema --md"}}};
  std::string text = "\nExamples:\n";
  for (const std::string& words : kExamples.at(verb))
    text += "  archetide-precompute " + words + "\n";
  return text;
}

// ---- verbs --------------------------------------------------------------------------------------

/// Runs `work`; the elements that an error is about go to a PLY, which the message then names.
template <class Work>
auto showing_offenders(const std::string& path, Work work) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);  // of an earlier attempt
  const auto write = [&path](const Offenders& error) {
    if (error.offenders.triangles.empty()) return std::string();
    write_ply(path, error.offenders);
    return "the elements in question: " + path;
  };
  try {
    return work();
  } catch (const SurfaceDefects& error) {
    std::vector<Diagnostic> list = error.diagnostics;
    const std::string note = write(error);
    if (!note.empty()) list.back().hint += "\n  " + note;
    throw InputError(list);
  } catch (const TetDefects& error) {
    const std::string note = write(error);
    throw NumericsError(error.what() + (note.empty() ? "" : "\n  " + note));
  }
}

/// X.part of the output in the making, for the handler below.
std::string unfinished;

/// On SIGINT, SIGTERM and SIGHUP: nothing half-written stays.
extern "C" void stop(int) {
  ::unlink(unfinished.c_str());
  constexpr char kText[] = "stopped; nothing was written\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText, sizeof kText - 1);
  ::_exit(kExitStopped);
}

/// From here on a signal stops the program cleanly; `output` is written when all is done.
void stop_cleanly(const std::string& output) {
  if (!output.empty()) unfinished = output + ".part";
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  if (std::signal(SIGHUP, stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // as nohup wants
}

/// The requested make fragment: made before the work, which a name that make cannot handle
/// would waste, and written after it.
class Depfile {
 public:
  Depfile(const CommandLine& c, const Recipe& recipe)
      : path_(c.depfile), text_(path_.empty() ? "" : depfile_text(c.output, recipe)) {}
  void write() const {
    if (!path_.empty()) write_file_atomically(path_, text_);
  }

 private:
  std::string path_, text_;
};

void refuse_skin(const std::string& path, const std::string& verb) {
  if (is_skin_file(path))
    throw InputError(path + " is a skin: it has no tets and no modes",
                     verb + " the archetypes of its parts");
}

Recipe recipe_of(const CommandLine& c) {
  Recipe recipe = read_recipe(c.input);
  recipe.tet.cpu_seconds = c.time_limit;
  return recipe;
}

void build(const CommandLine& c, Log& log) {
  stop_cleanly(c.output);
  const Recipe recipe = recipe_of(c);
  const Depfile depfile(c, recipe);
  { const AtomicFile writable(c.output); }  // complain before the work, not after it
  Profile profile;
  if (recipe.skin) {
    write_skin(c.output, build_skin(recipe, log, profile));
    depfile.write();
    return log.say(phase_table(profile));
  }
  const std::string defects = c.defects.empty() ? beside(c.output, ".defects.ply") : c.defects;
  BuildRecord record;
  const Archetype a =
      showing_offenders(defects, [&] { return build_archetype(recipe, log, profile, &record); });
  {
    const ScopedTimer timer(profile, "write");
    record.hash = write_archetype(c.output, a);
    depfile.write();
  }
  record.take_seconds(profile);
  write_record(c.output, record);
  log.say(phase_table(profile));
}

void check(const CommandLine& c, Log& log) {
  Profile profile;
  const Recipe recipe = recipe_of(c);
  if (recipe.skin) {
    std::cout << skin_text(build_skin(recipe, log, profile), 0);
    return log.detail(phase_table(profile));
  }
  const auto mesh = [&] { return mesh_body(recipe, log, profile); };
  std::cout << mesh_text(recipe, c.defects.empty() ? mesh() : showing_offenders(c.defects, mesh));
  log.detail(phase_table(profile));
}

void info(const CommandLine& c, Log&) {
  if (is_skin_file(c.input)) {
    const Skin skin = read_skin(c.input);
    const std::size_t size = std::filesystem::file_size(c.input);
    std::cout << (c.json ? skin_json(skin, size) : skin_text(skin, size));
    return;
  }
  const Archetype a = read_archetype(c.input);
  const std::size_t bytes = std::filesystem::file_size(c.input);
  const std::optional<BuildRecord> record = read_record(c.input, a.content_hash);
  std::cout << (c.json ? info_json(a, bytes, record) : info_text(a, bytes, record));
}

void report(const CommandLine& c, Log& log) {
  std::vector<std::string> bodies;
  for (const std::string& path : c.archetypes)
    if (is_skin_file(path))
      log.say(path + ": a skin, left out");
    else
      bodies.push_back(path);
  if (bodies.empty())
    throw InputError("there is nothing to report on: a skin has no tets and no modes",
                     "name the archetypes of its parts");
  write_archetype_report(c.output, bodies);
  log.say(fmt::format("{}: {} archetypes", c.output, bodies.size()));
}

void export_tets(const CommandLine& c, Log& log) {
  refuse_skin(c.input, "export");
  const Archetype a = read_archetype(c.input);
  if (c.output.ends_with(".hdf")) {
    if (c.mode != 0)
      throw InputError("--mode with a .hdf, which holds the rest shape and all modes",
                       "leave --mode out, and warp by the vector mode_K in ParaView");
    write_vtkhdf(c.output, a);
  } else {
    write_vtu(c.output, a, c.mode, c.amplitude >= 0 ? c.amplitude : 0.1 * longest_side(a));
  }
  log.say(fmt::format("{}: {} tets", c.output, a.tets.tets.size()));
}

/// The mesh as a body file beside `output` names it.
std::string mesh_name_of(const CommandLine& c) {
  if (!c.mesh_name.empty()) return c.mesh_name;
  if (c.output.empty()) return c.input;
  const std::filesystem::path folder = std::filesystem::path(c.output).parent_path();
  return std::filesystem::proximate(c.input, folder.empty() ? "." : folder).string();
}

ProposeRequest request_of(const CommandLine& c) {
  ProposeRequest request{c.input, mesh_name_of(c), c.output, c.scale, c.density, c.time_limit};
  if (c.output.empty())
    request.body = std::filesystem::path(c.input).replace_extension(".body.toml").string();
  return request;
}

constexpr char kProposeAgain[] =
    "\n  young depends on it: propose again with --scale (new-body: SCALE=)";

void propose(const CommandLine& c, Log& log) {
  if (!c.output.empty()) {
    if (std::filesystem::exists(std::filesystem::symlink_status(c.output)))
      throw InputError(c.output + " is there already", "remove it, or take another name");
    const AtomicFile writable(c.output);  // complain before the work, not after it
  }
  stop_cleanly(c.output);
  Profile profile;
  const Proposal proposal = propose_body(request_of(c), log, profile);
  if (!proposal.warning.empty()) log.warn(proposal.warning + kProposeAgain);
  log.detail(phase_table(profile));
  if (c.output.empty()) {
    log.say(proposal.summary);
    std::cout << proposal.text;
    return;
  }
  write_file_atomically(c.output, proposal.text);
  if (!c.quiet) std::cout << proposal.summary;
}

void print_schema(const CommandLine& c, Log&) {
  const Schema& schema = body_schema();
  std::cout << (c.json ? schema.json() : c.markdown ? schema.markdown() : schema.text());
}

// ---- command line -------------------------------------------------------------------------------

using Verb = void (*)(const CommandLine&, Log&);

void add_common_options(CLI::App& app, const std::string& verb, CommandLine& c) {
  app.add_option("-t,--threads", c.threads, "threads; more do not help below a million tets")
      ->envname("ARCHETIDE_THREADS")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  app.add_flag("-v,--verbose", c.verbose, "say more");
  app.add_flag("-q,--quiet", c.quiet, "say nothing but warnings and errors");
  app.add_option("--log", c.log_file, "also write the log to this file");
  app.footer(examples_of(verb) + kExitCodes);
}

CLI::App& add_verb(CLI::App& app, const std::string& name, const std::string& purpose, Verb verb,
                   CommandLine& c, Verb& chosen) {
  CLI::App& sub = *app.add_subcommand(name, purpose);
  sub.callback([&chosen, verb] { chosen = verb; });
  add_common_options(sub, name, c);
  return sub;
}

void add_time_limit(CLI::App& verb, CommandLine& c) {
  verb.add_option("--time-limit", c.time_limit,
                  "refuse a surface that takes longer to check, repair and mesh, CPU seconds (and "
                  "2e-4 for each tet)")
      ->check(positive_number())
      ->capture_default_str();
}

void add_verbs(CLI::App& app, CommandLine& c, Verb& chosen) {
  CLI::App& build_verb =
      add_verb(app, "build", "Compute an archetype: surface -> tets -> mass, stiffness -> modes",
               build, c, chosen);
  build_verb.add_option("body", c.input, "body file, NAME.body.toml")->required();
  build_verb.add_option("-o,--output", c.output, "archetype to write, OUT.h5")->required();
  build_verb.add_option("--depfile", c.depfile,
                        "also write a make fragment: OUT.h5 and what it depends on");

  build_verb.add_option("--defects", c.defects,
                        "where the elements that are wrong go (default: OUT.defects.ply)");
  add_time_limit(build_verb, c);

  CLI::App& check_verb =
      add_verb(app, "check", "Read and validate a body file, mesh it and report; no modes", check,
               c, chosen);
  check_verb.add_option("body", c.input, "body file, NAME.body.toml")->required();
  check_verb.add_option("--defects", c.defects, "write the elements that are wrong to this PLY");
  add_time_limit(check_verb, c);

  CLI::App& info_verb = add_verb(app, "info", "Print what an archetype holds", info, c, chosen);
  info_verb.add_option("archetype", c.input, "archetype, OUT.h5")->required();
  info_verb.add_flag("--json", c.json, "as JSON");

  CLI::App& export_verb = add_verb(app, "export", "Write the tets of an archetype for ParaView",
                                   export_tets, c, chosen);
  export_verb.add_option("archetype", c.input, "archetype, OUT.h5")->required();
  export_verb
      .add_option("-o,--output", c.output,
                  "file to write, F.vtu, or F.hdf (VTKHDF: rest shape and all modes)")
      ->required();
  export_verb
      .add_option("--mode", c.mode,
                  "displace by this mode, counted from 1 (0: rest shape, modes as fields)")
      ->capture_default_str();
  export_verb
      .add_option("--amplitude", c.amplitude,
                  "largest displacement, m (default: a tenth of the longest side)")
      ->check(non_negative_number());

  CLI::App& report_verb =
      add_verb(app, "report", "Write one page about archetypes: quality, mass, modes, pictures",
               report, c, chosen);
  report_verb.add_option("archetypes", c.archetypes, "archetypes, OUT.h5")->required();
  report_verb.add_option("-o,--output", c.output, "page to write, report.html")->required();

  CLI::App& propose_verb = add_verb(
      app, "propose", "Look at a mesh and write a body file that builds", propose, c, chosen);
  propose_verb.add_option("mesh", c.input, "surface or tets, of one closed solid")->required();
  propose_verb.add_option("-o,--output", c.output,
                          "body file to write, NAME.body.toml, not there yet (default: stdout)");
  propose_verb.add_option("--scale", c.scale, "from mesh units to metres")
      ->check(positive_number())
      ->capture_default_str();
  propose_verb.add_option("--density", c.density, "kg/m^3; water has 1000")
      ->check(positive_number())
      ->check(CLI::Range(kLeastDensity, kLargestDensity))
      ->capture_default_str();
  propose_verb.add_option("--mesh-name", c.mesh_name,
                          "what the body file calls the mesh (default: its path from there)");
  add_time_limit(propose_verb, c);

  CLI::App& schema_verb =
      add_verb(app, "schema", "List every key of a body file", print_schema, c, chosen);
  CLI::Option* json = schema_verb.add_flag("--json", c.json, "as JSON");
  schema_verb.add_flag("--md", c.markdown, "as Markdown")->excludes(json);
}

std::vector<std::string> verb_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    names.push_back(sub->get_name());
  }
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& known) {
  const std::string match = closest_match(word, known);
  return match.empty() ? "see archetide-precompute --help" : "did you mean '" + match + "'?";
}

/// What the parser complains about, with the verb or option that a mistyped word may mean.
InputError explain(const CLI::ParseError& error, const CLI::App& app) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const std::vector<std::string> words = app.remaining(true);  // what no verb or option claimed
  if (chosen.empty()) {
    const auto verb =
        std::find_if(words.begin(), words.end(), [](const std::string& w) { return w[0] != '-'; });
    if (verb != words.end()) return unknown_verb(*verb, verb_names(app));
  }
  const std::vector<std::string> known = option_names(chosen.empty() ? app : *chosen.front());
  for (const std::string& word : words) {
    const std::string name = word.substr(0, word.find('='));
    const bool mistyped = name.starts_with("--") && name != "--" &&
                          std::find(known.begin(), known.end(), name) == known.end();
    if (mistyped) return InputError("unknown option '" + name + "'", did_you_mean(name, known));
  }
  return InputError(error.what(), "see archetide-precompute --help");
}

int run(int argc, char** argv, Log& log) {
  CommandLine c;
  Verb chosen = nullptr;
  CLI::App app(
      "archetide-precompute: from a surface mesh and a body file to a body archetype (HDF5)");
  app.set_version_flag("--version", "archetide-precompute " ARCHETIDE_VERSION);
  app.require_subcommand(1);
  add_common_options(app, "", c);
  add_verbs(app, c, chosen);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // help, version
    throw explain(error, app);
  }
  using Level = Log::Level;
  log.set_level(c.quiet ? Level::kQuiet : c.verbose ? Level::kVerbose : Level::kNormal);
  if (!c.log_file.empty()) log.also_to(c.log_file);
  if (!c.output.empty()) make_folder_of(c.output);
  omp_set_num_threads(c.threads);
  chosen(c, log);
  flush_standard_output();
  return kExitDone;
}

/// Sets a variable of the environment; false when it had this value already.
bool changes(const char* name, const char* value) {
  const char* old = std::getenv(name);
  return (!old || std::string_view(old) != value) && ::setenv(name, value, 1) == 0;
}

/// Threads cannot fail where the address space is limited. Those of OpenBLAS, started before
/// main(), map 128 MiB each, try for ever when there is no room, and are waited for at the end;
/// those that CHOLMOD asks OpenMP for (four, whatever it is told) end the program with exit code 1.
/// Only the environment keeps them away: with it the program starts again.
void start_without_threads_if_space_is_limited(char** argv) {
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) != 0 || space.rlim_cur == RLIM_INFINITY) return;
  const bool blas = changes("OPENBLAS_NUM_THREADS", "1"), openmp = changes("OMP_THREAD_LIMIT", "1");
  if (!blas && !openmp) return;
  std::error_code unknown;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) ::execv(self.c_str(), argv);
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  using namespace archetide;
  start_without_threads_if_space_is_limited(argv);
  keep_freed_memory();
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of the file size fails instead
  Log log;
  try {
    return run(argc, argv, log);
  } catch (const InputError& error) {
    log.error(error.what());
    return error.exit_code;
  } catch (const Error& error) {
    log.error(std::string("error: ") + error.what());
    return error.exit_code;
  } catch (const std::bad_alloc&) {
    log.error("error: out of memory; ask for fewer tets (tet.target) or modes");
    return kExitMachine;
  } catch (const std::filesystem::filesystem_error& error) {
    log.error("error: " + file_system_message(error));
    return exit_code_of(error);
  } catch (const std::exception& error) {
    log.error(std::string("error: this is a bug of archetide-precompute: ") + error.what());
    return kExitBug;
  }
}
