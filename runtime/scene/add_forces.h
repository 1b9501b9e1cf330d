#pragma once

#include "runtime/scene/scene_builder.h"

namespace archetide {

/// The actuators of one [[force]]: one on every body that is called as it says. Bodies must be in
/// their final order. Throws InputError: no such body or point set, a rigid body, nothing left.
void add_force(const ForceSpec& spec, BuiltScene& built);

/// The loads of one [[external]], one on every body that is called as it says; bodies as above.
/// Throws InputError: no such body, or what the table cannot say; FileError: no such table.
void add_external(const ExternalSpec& spec, BuiltScene& built);

/// The vertices of a named point set. Throws InputError at `where`.
const std::vector<int>& point_set_of(const Archetype& archetype, const std::string& name,
                                     const SourceLocation& where);

}  // namespace archetide
