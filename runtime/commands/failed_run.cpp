#include "runtime/commands/failed_run.h"

#include <fmt/core.h>
#include <omp.h>

#include <filesystem>

#include "runtime/scene/parse_scene.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

// ["torus", "/bodies/star.h5"]
std::string list_of_kinds(const ScatterSpec& scatter) {
  std::string list;
  for (const BodySpec& kind : scatter.kinds) {
    const bool path = kind.archetype.ends_with(".h5");
    list += (list.empty() ? "[\"" : ", \"") +
            (path ? fs::absolute(kind.archetype).string() : kind.archetype) + "\"";
  }
  return list + "]";
}

// The scene with paths that hold from anywhere.
std::string portable_scene(const SceneSpec& scene) {
  std::vector<std::string> paths;
  const auto fix = [&](const std::string& key, const std::string& path) {
    if (!path.empty()) paths.push_back(key + "=\"" + fs::absolute(path).string() + "\"");
  };
  for (std::size_t n = 0; n < scene.statics.size(); ++n)
    fix(fmt::format("static[{}].mesh", n), scene.statics[n].mesh);
  if (scene.fluid) fix("fluid.water.mesh", scene.fluid->water.mesh);
  const auto fix_archetype = [&](const std::string& list, std::size_t n, const std::string& name) {
    if (name.ends_with(".h5")) fix(fmt::format("{}[{}].archetype", list, n), name);
  };
  for (std::size_t n = 0; n < scene.bodies.size(); ++n)
    fix_archetype("body", n, scene.bodies[n].archetype);
  for (std::size_t n = 0; n < scene.scatters.size(); ++n) {
    const ScatterSpec& scatter = scene.scatters[n];
    if (!scatter.mixed) fix_archetype("scatter", n, scatter.kinds[0].archetype);
    fix(fmt::format("scatter[{}].mesh", n), scatter.mesh);
    if (scatter.mixed)
      paths.push_back(fmt::format("scatter[{}].archetypes={}", n, list_of_kinds(scatter)));
  }
  for (std::size_t n = 0; n < scene.skins.size(); ++n)
    fix_archetype("skin", n, scene.skins[n].archetype);
  return paths.empty() ? scene.text : parse_scene_text(scene.text, scene.file, paths).text;
}

}  // namespace

FailureSetup failure_setup(const SceneSpec& scene, const Arguments& a,
                           const ArchetypeLibrary& library,
                           const std::vector<std::string>& body_names,
                           const std::vector<std::string>& joint_names) {
  FailureSetup setup{a.out, portable_scene(scene), "", body_names, joint_names};
  for (const std::string& name : archetype_names(scene)) {
    if (name.ends_with(".h5")) continue;
    const fs::path folder = fs::absolute(library.path(name)).parent_path();
    setup.options = " --archetypes '" + folder.lexically_normal().string() + "'";
  }
  if (a.frames) setup.options += fmt::format(" --frames {}", *a.frames);
  setup.options += fmt::format(" -t {}", omp_get_max_threads());
  return setup;
}

int finish_broken_run(const SimulationFailure& failure, const FailureSetup& setup,
                      const CheckpointIdentity& identity, const Simulation& simulation,
                      const VisitState& visit, bool quiet, RunWriter& writer) {
  const std::string replay = write_failure(setup, failure, identity, simulation, visit);
  const std::string names = culprit_names(failure.culprit, setup);
  const std::string reason = failure.what() + (names.empty() ? "" : ": " + names);
  writer.finish(kExitNumerics, reason, simulation);
  writer.log("see " + setup.run_folder + "/failure; replay: " + replay);
  if (quiet) log_error("error: " + reason);
  return kExitNumerics;
}

}  // namespace archetide
