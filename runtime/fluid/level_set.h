#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/grid/grid.h"

namespace archetide {

/// Moves the zero level of phi [OS88] (negative in water) over dt: semi-Lagrangian, midpoint
/// back-traces, tricubic interpolation. Only cells with |phi| < band (m) change; and where the
/// velocity crosses more than `still` cells in dt, as many cells beyond as it crosses more, where
/// phi need not be a distance: the surface may come to lie there as well. Outside an open side of
/// the tank is air: water standing there does not flow in for ever.
void advect_level_set(const Grid& g, const MacField& u, double dt, Array3<double>& phi, double band,
                      const Sides& open_side = {}, double still = INFINITY);

/// Volume of phi < 0, m^3: per cell that of the half space phi + grad phi . (x - centre) < 0, exact
/// for planes, times what the solids leave of the cell when their fractions are given. phi must be
/// a distance (|grad phi| near 1) where |phi| < dx.
double water_volume(const Grid& g, const Array3<double>& phi,
                    const Array3<double>* solid_fraction = nullptr);

/// Wet fraction of cell n = (i, j, k) of phi + shift, as `water_volume` takes it, without solids.
double wet_fraction(const Grid& g, const Array3<double>& phi, int i, int j, int k, std::size_t n,
                    double shift = 0.0);

/// What a solid leaves of a cell; fractions of overlapping solids add up to more than 1.
inline double open_fraction(double solid_fraction) {
  return std::min(std::max(1.0 - solid_fraction, 0.0), 1.0);
}

/// Fraction of the unit cube about 0 where value + m . x < 0, exact to round-off for every m.
double half_space_fraction(double value, const Vec3& m);

}  // namespace archetide
