// Writes the files that a run reads as a make fragment.

#include <CLI/CLI.hpp>

#include "common/files/atomic_file.h"
#include "common/files/make_word.h"
#include "runtime/commands/command.h"
#include "runtime/scene/scene_builder.h"

namespace archetide {
namespace {

int deps(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  const ArchetypeLibrary library(scene.directory, a.archetypes);
  write_file_atomically(a.out, make_fragment(a.target, scene_dependencies(scene, library)));
  return kExitDone;
}

}  // namespace

SimCommand deps_command() {
  return {
      "deps",
      "write the files that a run reads as a make fragment",
      {"deps assets/scenes/tub.scene.toml -o out/.state/tub.d out/runs/tub/done.stamp"},
      deps,
      [](CLI::App& app, Arguments& a) {
        scene_options(app, a);
        app.add_option("-o,--output", a.out, "the fragment")->required()->type_name("F");
        app.add_option("target", a.target, "what depends on them")->required()->type_name("TARGET");
      }};
}

}  // namespace archetide
