#pragma once

#include "runtime/scene/scene_builder.h"

namespace archetide {

/// A [[static]] with a motion, `placed` as it stands without it: a rigid body of the scene that goes as
/// it is told, called as its mesh. Throws FileError, InputError for a table that is none.
void add_moving_obstacle(const StaticSpec& spec, const TriMesh& placed,
                         const std::optional<ContactMaterial>& contact, BuiltScene& built);

}  // namespace archetide
