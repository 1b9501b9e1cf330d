// Body file -> archetype or skin.

#include "precompute/build.h"

#include <CLI/CLI.hpp>

#include "common/archetype/archetype.h"
#include "common/files/atomic_file.h"
#include "precompute/build_skin.h"
#include "precompute/commands/command.h"
#include "precompute/commands/offenders.h"
#include "precompute/commands/stop_cleanly.h"

namespace archetide {
namespace {

/// The requested make fragment: made before the work, which a name that make cannot handle
/// would waste, and written after it.
class Depfile {
 public:
  Depfile(const BodyArguments& a, const Recipe& recipe)
      : path_(a.depfile), text_(path_.empty() ? "" : depfile_text(a.output, recipe)) {}
  void write() const {
    if (!path_.empty()) write_file_atomically(path_, text_);
  }

 private:
  std::string path_, text_;
};

void build_skin_file(const BodyArguments& a, const Recipe& recipe, const Depfile& depfile) {
  Profile profile;
  write_skin(a.output, build_skin(recipe, profile));
  depfile.write();
  log_info(phase_table(profile));
}

void build_archetype_file(const BodyArguments& a, const Recipe& recipe, const Depfile& depfile) {
  Profile profile;
  const std::string defects = a.defects.empty() ? beside(a.output, ".defects.ply") : a.defects;
  BuildRecord record;
  const Archetype archetype =
      showing_offenders(defects, [&] { return build_archetype(recipe, profile, &record); });
  {
    const ScopedTimer timer(profile, "write");
    record.hash = write_archetype(a.output, archetype);
    depfile.write();
  }
  record.take_seconds(profile);
  write_record(a.output, record);
  log_info(phase_table(profile));
}

int build(const BodyArguments& a) {
  make_folder_of(a.output);
  stop_cleanly(a.output);
  const Recipe recipe = recipe_of(a);
  const Depfile depfile(a, recipe);
  { const AtomicFile writable(a.output); }  // complain before the work, not after it
  (recipe.skin ? build_skin_file : build_archetype_file)(a, recipe, depfile);
  return kExitDone;
}

}  // namespace

BodyCommand build_body_command() {
  return {
      "build",
      "Compute an archetype: surface -> tets -> mass, stiffness -> modes",
      {"build assets/bodies/torus.body.toml -o out/archetypes/torus.h5",
       "build duck.body.toml -o duck.h5 --depfile duck.h5.d --time-limit 120"},
      build,
      [](CLI::App& app, BodyArguments& a) {
        app.add_option("body", a.input, "body file, NAME.body.toml")->required()->type_name("BODY");
        app.add_option("-o,--output", a.output, "archetype to write, OUT.h5")
            ->required()
            ->type_name("OUT.h5");
        app.add_option("--depfile", a.depfile,
                       "also write a make fragment: OUT.h5 and what it depends on")
            ->type_name("F");
        app.add_option("--defects", a.defects,
                       "where the elements that are wrong go (default: OUT.defects.ply)")
            ->type_name("F.ply");
        time_limit_option(app, a);
      }};
}

}  // namespace archetide
