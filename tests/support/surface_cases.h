#pragma once

#include "runtime/fluid/surface.h"

namespace archetide {

/// Surfaces carried by a given flow, alone.

/// A state whose surface has been prepared, without solids.
FluidState state_of(const Grid& g, const SurfaceOptions& options, const Array3<double>& phi,
                    const MacField& u);

/// `flow` times cos(pi t / period) over one period: all comes back to where it was.
void advance_there_and_back(const Grid& g, const MacField& flow, double period, int steps,
                            const SurfaceOptions& options, FluidState& s);

struct ZalesakResult {
  double area_change = 0.0;  // relative
  int misplaced = 0;         // cells on the wrong side, of 582 in the disk
};
/// Zalesak's disk turned once in a slab of 100 x 100 x 4 cells.
ZalesakResult zalesak_disk(int per_cell);

/// Sphere in the three-dimensional reversed deformation field of [LeV96], run by [EMF02] on
/// 100^3 cells; relative change of its volume when it comes back.
double enright_volume_change(int n, int per_cell);

}  // namespace archetide
