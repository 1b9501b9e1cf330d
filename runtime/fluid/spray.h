#pragma once

#include "runtime/fluid/fluid_state.h"

namespace archetide {

/// Drops that the surface cannot hold: water particles of the particle level set that have come
/// away from it fly on their own until they fall into water again (removed particles, [GSLF05]:
/// Guendelman, Selle, Losasso, Fedkiw, SIGGRAPH 2005). Each carries the water that it stood for, a
/// cell's share among per_cell particles. Residual that the flow has taken out of the surface's
/// reach flies likewise (see surface_refit.h). Where drops land the water takes up their volume and
/// momentum; bodies do not feel them.

/// Water particles that are a cell or more from the surface become drops, with the velocity u has
/// there. Those in solids (mask != 0; an empty mask: none) do not. Returns the volume that they
/// take, m^3, which the residual (dx^3 a cell) of theirs gives.
double release_spray(const Grid& g, const Array3<double>& phi, const MacField& u,
                     const Array3<unsigned char>& solid, int per_cell, Particles& particles,
                     Array3<double>& residual, Spray& spray);

/// Residual that the flow has taken away from the surface, 3 cells from all water, flies as drops,
/// one a cell, where it is enough to matter.
void release_fragments(const Grid& g, const Array3<double>& phi, const MacField& u,
                       const Array3<double>& solid_fraction, Array3<double>& residual,
                       Spray& spray);

/// A drop that has come to water.
struct Landing {
  Vec3 position, velocity;  // m, m/s
  double volume;            // m^3
};

/// Volumes of the drops that are gone, m^3.
struct SprayEnds {
  double landed = 0.0;  // in water
  std::vector<Landing> landings = {};
  double left = 0.0;  // through open sides of the tank
};

/// Drops fly for dt under gravity, m/s^2, slide along solids and closed sides of the tank, and end
/// in water, of whose residual they become part, and open sides. The cell fields cover the tank up
/// to a ceiling; above it there is air.
SprayEnds fly_spray(const Grid& tank, const Sides& open_side, const Vec3& gravity, double dt,
                    const Array3<double>& phi, const Array3<double>& solid_fraction,
                    Array3<double>& residual, Spray& spray);

/// The momentum of drops that have landed goes to the faces around, by trilinear weights: their
/// water joins that of u. `held`: water of each cell, dx^3; a face counts as a quarter of a cell at
/// least, so that a heavy drop does not throw a little water.
void take_up_momentum(const Grid& g, const std::vector<Landing>& landings,
                      const Array3<double>& held, MacField& u);

double spray_volume(const Spray& spray);

/// Kinetic and potential energy over the density, and momentum over it, m^5/s^2 and m^4/s.
struct SprayMotion {
  double kinetic = 0.0, potential = 0.0;
  Vec3 momentum = Vec3::Zero(), angular_momentum = Vec3::Zero();
  Vec3 moment = Vec3::Zero();  // sum of volume times place, m^4
};
SprayMotion spray_motion(const Spray& spray, const Vec3& gravity);

}  // namespace archetide
