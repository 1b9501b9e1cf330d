#pragma once

#include "runtime/scene/scene_builder.h"

namespace archetide {

/// Places the parts of the scene's skins, binds the skins to them and adds their joints. `built`
/// has the bodies that the skins name. Throws InputError when a skin's parts are others, FileError.
void add_skins(const SceneSpec& scene, ArchetypeLibrary& library, BuiltScene& built);

/// Size of the cells that rungs are chosen for, m; 0, which no rung fits: the water meets all
/// triangles of bodies and skins, or there is none.
double cell_of_rungs(const SceneSpec& scene, const SimulationOptions& options);

}  // namespace archetide
