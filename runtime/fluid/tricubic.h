#pragma once

#include "runtime/fluid/path_block.h"

namespace archetide {

/// Tricubic (Lagrange) value of f at lattice coordinates s, clamped to the lattice; of lower degree
/// along axes with fewer than four points.
double tricubic(const Array3<double>& f, const double s[3]);

/// The same with its gradient (per lattice step).
double tricubic(const Array3<double>& f, const double s[3], Vec3& gradient);

/// The values at the places d (cells, |d| <= 1) from the points p, p + 1, .., which are at least
/// two points away from the lattice's ends.
void tricubic_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride, const Block d[3],
                    Block& out);

}  // namespace archetide
