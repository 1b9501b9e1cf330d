#include "runtime/scene/archetype_library.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "common/archetype/archetype.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

// Calls visit(name, place) for every use of an archetype.
template <class Visit>
void for_each_use(const SceneSpec& scene, const Visit& visit) {
  for (const BodySpec& body : scene.bodies) visit(body.archetype, body.where);
  for (const ScatterSpec& scatter : scene.scatters)
    for (const BodySpec& kind : scatter.kinds) visit(kind.archetype, kind.where);
  for (const SkinSpec& skin : scene.skins) visit(skin.archetype, skin.where);
}

}  // namespace

ArchetypeLibrary ArchetypeLibrary::looking_in(std::vector<std::string> otherwise,
                                              const std::string& folder) {
  const char* environment = std::getenv("ARCHETIDE_ARCHETYPES");
  ArchetypeLibrary library;
  if (!folder.empty())
    library.folders_ = {folder};
  else if (environment && *environment)
    library.folders_ = {environment};
  else
    library.folders_ = std::move(otherwise);
  return library;
}

ArchetypeLibrary::ArchetypeLibrary(const std::string& scene_directory, const std::string& folder)
    : ArchetypeLibrary(looking_in(
          {(fs::path(scene_directory) / "../../out/archetypes").lexically_normal().string(),
           "out/archetypes"},
          folder)) {}

std::string ArchetypeLibrary::path(const std::string& archetype) const {
  if (archetype.ends_with(".h5")) return archetype;
  std::string first;
  for (const std::string& folder : folders_) {
    const std::string candidate = (fs::path(folder) / (archetype + ".h5")).string();
    if (fs::exists(candidate)) return candidate;
    if (first.empty()) first = candidate;
  }
  return first;
}

void ArchetypeLibrary::require_all(const SceneSpec& scene) const {
  std::string message;
  std::vector<std::string> named;
  for_each_use(scene, [&](const std::string& archetype, const SourceLocation& where) {
    const bool known = std::find(named.begin(), named.end(), archetype) != named.end();
    if (known || fs::exists(path(archetype))) return;
    named.push_back(archetype);
    const std::string what = "there is no archetype file " + path(archetype);
    std::string hint =
        "build it with archetide-precompute build BODY.body.toml -o " + path(archetype);
    if (!archetype.ends_with(".h5")) {
      hint =
          "build it with 'make -f pipeline.mk bodies' (from assets/bodies/" + archetype +
          ".body.toml), or say where archetypes are with --archetypes DIR or ARCHETIDE_ARCHETYPES";
    }
    message += (message.empty() ? "" : "\n") + Diagnostic{where, what, hint}.text();
  });
  if (!message.empty()) throw FileError(message);
}

std::shared_ptr<const Archetype> ArchetypeLibrary::load(const std::string& archetype, Part part) {
  const std::string file = path(archetype);
  std::shared_ptr<const Archetype>& entry = cache_[{file, part}];
  if (!entry) entry = std::make_shared<const Archetype>(read_archetype(file, part));
  return entry;
}

std::shared_ptr<const NodalSpace> ArchetypeLibrary::nodes_of(
    const std::shared_ptr<const Archetype>& archetype) {
  std::shared_ptr<const NodalSpace>& entry = nodes_[archetype.get()];
  if (!entry) entry = std::make_shared<const NodalSpace>(archetype);
  return entry;
}

std::shared_ptr<const Skin> ArchetypeLibrary::load_skin(const std::string& archetype) {
  const std::string file = path(archetype);
  std::shared_ptr<const Skin>& entry = skins_[file];
  if (!entry) entry = std::make_shared<const Skin>(read_skin(file));
  return entry;
}

std::vector<std::string> archetype_names(const SceneSpec& scene) {
  std::vector<std::string> names;
  for_each_use(scene, [&](const std::string& archetype, const SourceLocation&) {
    if (std::find(names.begin(), names.end(), archetype) == names.end()) names.push_back(archetype);
  });
  return names;
}

std::vector<std::string> scene_dependencies(const SceneSpec& scene,
                                            const ArchetypeLibrary& library) {
  std::vector<std::string> files = {scene.file};
  for (const std::string& archetype : archetype_names(scene))
    files.push_back(library.path(archetype));
  for (const StaticSpec& obstacle : scene.statics) {
    files.push_back(obstacle.mesh);
    if (!obstacle.motion_csv.empty()) files.push_back(obstacle.motion_csv);
  }
  for (const ScatterSpec& scatter : scene.scatters)
    if (!scatter.mesh.empty()) files.push_back(scatter.mesh);
  for (const ExternalSpec& load : scene.externals)
    if (!load.csv.empty()) files.push_back(load.csv);
  if (scene.fluid && !scene.fluid->water.mesh.empty()) files.push_back(scene.fluid->water.mesh);
  std::vector<std::string> unique;
  for (const std::string& file : files) {
    if (std::find(unique.begin(), unique.end(), file) == unique.end()) unique.push_back(file);
  }
  return unique;
}

}  // namespace archetide
