#pragma once

#include "runtime/grid/grid.h"

namespace archetide {

/// Moves the zero level of phi (negative in water) over dt: semi-Lagrangian, midpoint back-traces,
/// tricubic interpolation. Only cells with |phi| < band (m) change. Outside an open side of the
/// tank is air: water standing there does not flow in for ever.
void advect_level_set(const Grid& g, const MacField& u, double dt, Array3<double>& phi, double band,
                      const Sides& open_side = {});

/// Volume of phi < 0, m^3: per cell that of the half space phi + grad phi . (x - centre) < 0, exact
/// for planes, times the cell's open fraction when given. phi must be a distance (|grad phi| near
/// 1) where |phi| < dx.
double water_volume(const Grid& g, const Array3<double>& phi,
                    const Array3<double>* cell_open_fraction = nullptr);

/// Fraction of the unit cube about 0 where value + m . x < 0, exact to round-off for every m.
double half_space_fraction(double value, const Vec3& m);

}  // namespace archetide
