#pragma once

#include <string>
#include <vector>

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// From this part of a body's radius on its linear modes do not tell how it deforms: a bar whose
/// tip moves by 30 % of its length is 8 % off, a ring pinched by as much 29 % [D59].
constexpr double kModesTell = 0.3;

/// What a body falls on: the water, the floor of the tank, or, in a crowd, another body.
enum class FallsOn { kWater, kFloor, kBody };

/// How far the bodies of one archetype will deform, estimated before the run: the largest modal
/// displacement of a surface point over the radius, as `max_deformation` of the run.
struct DeformationForecast {
  std::string archetype;
  bool nonlinear = false;  // its modes go beyond kModesTell
  double weight = 0.0;     // of a body that lies on its lowest points, 1
  double impact = 0.0;     // in its worst impact, 1
  double speed = 0.0;      // of that impact, m/s
  FallsOn on = FallsOn::kFloor;

  double largest() const { return weight > impact ? weight : impact; }
};

/// One for each archetype with modes, in the order of the bodies; of its bodies the worst counts,
/// for weight and impact each (docs/method.md, S16 to S19). Scattered bodies that touch each other
/// also fall on the heaviest of the others. `bodies`: those of `scene.bodies` first. O(bodies
/// vertices r).
std::vector<DeformationForecast> forecast_deformation(const SceneSpec& scene,
                                                      const SimulationOptions& options,
                                                      const std::vector<ReducedBody>& bodies);

/// "torus: 3 % under its weight, 24 % in the impact at 3.1 m/s on the water (modes tell to 30 %)".
std::string forecast_text(const DeformationForecast& forecast);

/// What to know, and to do, when linear modes cannot tell; else empty.
std::string beyond_modes(const DeformationForecast& forecast);

/// The same where the water at the lowest place of the tank presses a body together by more than a
/// tenth of its volume, or makes slender ones of nonlinear modes whip through still water [D82].
std::string beyond_pressure(const ReducedBody& body, const SimulationOptions& options);

}  // namespace archetide
