#pragma once

#include "runtime/grid/array3.h"

namespace archetide {

/// Tricubic (Lagrange) value of f at lattice coordinates s, clamped to the lattice; of lower degree
/// along axes with fewer than four points.
double tricubic(const Array3<double>& f, const double s[3]);

/// The same with its gradient (per lattice step).
double tricubic(const Array3<double>& f, const double s[3], Vec3& gradient);

}  // namespace archetide
