#pragma once

#include "runtime/scene/scene_builder.h"

namespace archetide {

/// Places the parts of the scene's skins, binds the skins to them and adds their joints. `built`
/// has the bodies that the skins name. Throws InputError when a skin's parts are others, FileError.
void add_skins(const SceneSpec& scene, ArchetypeLibrary& library, BuiltScene& built);

}  // namespace archetide
