#pragma once

#include "runtime/scene/scene_builder.h"
#include "runtime/scene/scene_spec.h"

namespace archetide {

/// Complaints about bodies that begin where none can be: beyond a closed side of the tank, or
/// inside another one that they are not joined to. What a contact can push apart in a step, less
/// than a cell, is let through. `built`: bodies, joints and skins of the scene, those of [[body]]
/// first.
std::vector<Diagnostic> misplaced_bodies(const SceneSpec& scene, const BuiltScene& built);

}  // namespace archetide
