#pragma once

#include "runtime/fluid/fluid_state.h"

namespace archetide {

/// Drops that the surface cannot hold: water particles of the particle level set that have come
/// away from it fly on their own until they fall into water again (removed particles, [GSLF05]:
/// Guendelman, Selle, Losasso, Fedkiw, SIGGRAPH 2005). Each carries the water that it stood for, a
/// cell's share among per_cell particles. The water does not feel them land, and bodies do not feel
/// them.

/// Water particles that are a cell or more from the surface become drops, with the velocity u has
/// there. Those in solids (mask != 0; an empty mask: none) do not. Returns the volume that they
/// take, m^3.
double release_spray(const Grid& g, const Array3<double>& phi, const MacField& u,
                     const Array3<unsigned char>& solid, int per_cell, Particles& particles,
                     Spray& spray);

/// Volumes of the drops that are gone, m^3.
struct SprayEnds {
  double landed = 0.0;  // in water or on a solid
  double left = 0.0;    // through open sides of the tank
};

/// Drops fly for dt under gravity, m/s^2, slide down closed sides of the tank, and end in water,
/// solids and open sides. phi and solid cover the tank up to a ceiling; above it there is air.
SprayEnds fly_spray(const Grid& tank, const Sides& open_side, const Vec3& gravity, double dt,
                    const Array3<double>& phi, const Array3<unsigned char>& solid, Spray& spray);

double spray_volume(const Spray& spray);

}  // namespace archetide
