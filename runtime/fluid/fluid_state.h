#pragma once

#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Marker particles of the particle level set [EMF02], structure of arrays. sign +1: outside (air)
/// particle, -1: inside (water) particle.
struct Particles {
  std::vector<Vec3> position;  // m
  std::vector<float> radius;   // m
  std::vector<signed char> sign;
  std::size_t size() const { return position.size(); }
};

/// Drops in the air, structure of arrays; see spray.h.
struct Spray {
  std::vector<Vec3> position, velocity;  // m, m/s
  std::vector<double> volume;            // m^3
  std::size_t size() const { return position.size(); }
};

/// The water between two steps. A grid with zero cells means: no water at all.
struct FluidState {
  MacField u;           // m/s; valid on open water faces, extrapolated around them
  Array3<double> phi;   // signed distance to the free surface at cell centres, m, negative in water
  Particles particles;  // empty when the scene asks for none
  Spray spray;          // empty when the scene asks for none
  std::vector<Vec3> markers;  // passive points, m; see markers.h
  double time = 0.0;          // s
};

}  // namespace archetide
