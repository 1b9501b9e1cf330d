#pragma once

#include <cstdint>

#include "runtime/fluid/fluid_state.h"

namespace archetide {

/// The particle level set method [EMF02]: markers on both sides of the surface remember where it
/// was. Nothing here depends on the number of threads.

/// Fills the cells within 2 dx of the surface up to per_cell particles, thins out the fuller ones,
/// and removes those inside solids (mask != 0; an empty mask means none) and those far from the
/// surface. Positions are random, keyed by cell and `epoch`. Leaves the particles sorted by cell.
/// Seeds when there are none.
void reseed_particles(const Grid& g, const Array3<double>& phi, const Array3<unsigned char>& solid,
                      int per_cell, std::uint64_t epoch, Particles& particles);

/// Moves every particle over dt (midpoint rule, trilinear velocities), clamped to the tank.
void advect_particles(const Grid& g, const MacField& u, double dt, Particles& particles);

/// Repairs phi around the particles that are on the wrong side by more than their radius. Those in
/// solids do not count. Returns the number of escaped particles.
int correct_level_set(const Grid& g, const Particles& particles, const Array3<unsigned char>& solid,
                      Array3<double>& phi);

/// Radius of each particle = its distance to the surface, within 0.1 dx .. 0.5 dx. What the surface
/// has passed since it was that of `before` is on the other side now.
void adjust_radii(const Grid& g, const Array3<double>& phi, const Array3<double>& before,
                  Particles& particles);

}  // namespace archetide
