#pragma once

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// What a body meets on its way down, without other bodies, obstacles and joints. Down is along
/// gravity; without gravity, where the body goes.
struct Fall {
  Vec3 up = Vec3::UnitZ();  // unit vector, world
  double in_air = 0.0;      // speed at the end of its way through air, m/s; 0: it begins in water
  double into_water = 0.0;  // speed at which it meets the water, m/s; 0: it does not
  double onto_floor = 0.0;  // at which it meets the tank's floor, m/s; 0: it does not
  double pull = 0.0;        // what draws it down when it lies there, m/s^2; 0: it floats
};

/// From the place where the body begins, with its velocity (docs/method.md, S19). The water of a
/// mesh is not seen: the body falls to the floor.
Fall fall_of(const SceneSpec& scene, const SimulationOptions& options, const ReducedBody& body);

}  // namespace archetide
