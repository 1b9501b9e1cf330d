#include "runtime/fluid/surface.h"

#include <algorithm>
#include <cmath>

#include "runtime/fluid/extrapolation.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/particle_level_set.h"
#include "runtime/fluid/redistance.h"

namespace archetide {
namespace {

constexpr int kSolidLayers =
    12;  // cells into a body that the surface is continued; beyond the band's reach
constexpr int kSheetLayers = 4;  // cells into a body that distances see the surface
constexpr int kMargin = 3;       // cells that the interface must keep from the last ones that move

// Distances of the surface and of its continuation into solids.
void measure(const Grid& g, Array3<double>& phi, const SurfaceOptions& options,
             const Array3<unsigned char>& solid_cells) {
  const double band = options.band_cells * g.dx;
  const Array3<unsigned char> sheet = continue_surface(g, phi, solid_cells, kSheetLayers);
  extend_level_set(g, phi, solid_cells, kSolidLayers, band, sheet);
  redistance(g, phi, band, solid_cells, sheet, options.air_beyond);
}

}  // namespace

void advance_surface(const Grid& g, FluidState& state, double dt, const SurfaceOptions& options,
                     const Array3<unsigned char>& solid_cells, long step) {
  if (g.cells() == 0) return;
  const double band = options.band_cells * g.dx;
  advect_level_set(g, state.u, dt, state.phi, band, options.open_side,
                   options.band_cells - kMargin);
  advect_particles(g, state.u, dt, state.particles);
  correct_level_set(g, state.particles, solid_cells, state.phi);
  measure(g, state.phi, options, solid_cells);
  correct_level_set(g, state.particles, solid_cells, state.phi);
  adjust_radii(g, state.phi, state.phi, state.particles);
  const bool due = step % options.reseed_every == 0 || state.particles.size() == 0;
  if (options.particles_per_cell > 0 && due)
    reseed_particles(g, state.phi, solid_cells, options.particles_per_cell, step + 1,
                     state.particles);
}

void prepare_surface(const Grid& g, FluidState& state, const SurfaceOptions& options,
                     const Array3<unsigned char>& solid_cells) {
  if (g.cells() == 0) return;
  measure(g, state.phi, options, solid_cells);
  if (options.particles_per_cell > 0)
    reseed_particles(g, state.phi, solid_cells, options.particles_per_cell, 0, state.particles);
}

}  // namespace archetide
