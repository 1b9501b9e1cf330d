#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/archetype/skin.h"
#include "runtime/scene/scene_spec.h"
#include "runtime/solid/nodal_space.h"

namespace archetide {

/// Finds archetypes by name and reads each of them once.
class ArchetypeLibrary {
 public:
  /// `folder` (--archetypes) or else ARCHETIDE_ARCHETYPES is the only place to look when given;
  /// otherwise <scene folder>/../../out/archetypes and then out/archetypes.
  ArchetypeLibrary(const std::string& scene_directory, const std::string& folder = "");
  /// The same without a scene: `otherwise` are the places to look in.
  static ArchetypeLibrary looking_in(std::vector<std::string> otherwise, const std::string& folder);

  /// The file of an archetype: a value ending in .h5 is a path already, a name becomes the first
  /// candidate that exists, or the first candidate when none does.
  std::string path(const std::string& archetype) const;

  /// Throws one FileError that names every archetype of the scene without a file, and how to build
  /// it.
  void require_all(const SceneSpec& scene) const;

  /// Reads what the runtime needs, cached; a body with modes also needs the tets (Part::kAll).
  std::shared_ptr<const Archetype> load(const std::string& archetype, Part part = Part::kRuntime);
  /// Every node of an archetype of Part::kAll that keeps its tets, shared by its bodies.
  std::shared_ptr<const NodalSpace> nodes_of(const std::shared_ptr<const Archetype>& archetype);
  std::shared_ptr<const Skin> load_skin(const std::string& archetype);

 private:
  ArchetypeLibrary() = default;

  std::vector<std::string> folders_;
  std::map<std::pair<std::string, Part>, std::shared_ptr<const Archetype>> cache_;
  std::map<const Archetype*, std::shared_ptr<const NodalSpace>> nodes_;
  std::map<std::string, std::shared_ptr<const Skin>> skins_;
};

/// Archetype names of a scene, skins included, each once, in the order of the file.
std::vector<std::string> archetype_names(const SceneSpec& scene);

/// Every file that a run of the scene reads: the scene, archetypes, obstacles, water mesh.
std::vector<std::string> scene_dependencies(const SceneSpec& scene,
                                            const ArchetypeLibrary& library);

}  // namespace archetide
