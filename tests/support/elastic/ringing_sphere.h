#pragma once

#include <memory>

#include "runtime/simulation.h"

namespace archetide {

/// An elastic sphere (Poisson 0.3, half of the water's density, radius 0.2 m) of quadratic tets
/// with static pressure responses, enough modes for surface harmonics of degree 2 and 3.
std::shared_ptr<const Archetype> soft_sphere(int tets);

/// It rings in one of its wet modes, in a tank of 6 radii.
struct RingingOptions {
  int degree = 2;  // n of the mode, 2 or 3
  int cells_per_radius = 4;
  double step = 0.1;  // omega dt
  bool open_top = false;
  double periods = 2.0;
};
struct Ringing {
  /// omega against that of an elastic sphere in unbounded water (closed form; that of the
  /// trapezoidal rule at this step), relative.
  double frequency = 0.0;
  double amplitude = 0.0;  // relative change in a period
  int iterations = 0;      // of the worst solve
};
Ringing ring_in_water(const std::shared_ptr<const Archetype>& sphere, const RingingOptions& o);

}  // namespace archetide
