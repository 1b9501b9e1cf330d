#pragma once

#include "runtime/fluid/fluid_state.h"

namespace archetide {

struct SurfaceOptions {
  int particles_per_cell = 0;  // 0: plain level set; 16 to 64 keep thin features
  int band_cells = 5;          // phi is a distance this far from the surface, cells; 4 .. 10
  int reseed_every = 20;       // steps between reseedings [EMF02]
  Sides open_side{};           // sides of the tank beyond which is air
  Sides air_beyond{};          // those at which the water ends
};

/// Moves the free surface over dt with state.u, which must be valid up to ceil(cfl) + 4 cells
/// beyond the water. solid_cells: cells mostly inside a body or obstacle (may be empty); the
/// surface goes on into them as a plane. `step` counts steps and keys the random numbers.
void advance_surface(const Grid& g, FluidState& state, double dt, const SurfaceOptions& options,
                     const Array3<unsigned char>& solid_cells, long step);

/// Makes phi of a scene ready for the first step: distance within the band, continued into solids,
/// particles seeded.
void prepare_surface(const Grid& g, FluidState& state, const SurfaceOptions& options,
                     const Array3<unsigned char>& solid_cells);

}  // namespace archetide
