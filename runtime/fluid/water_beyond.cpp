#include "runtime/fluid/water_beyond.h"

#include <algorithm>

#include "runtime/fluid/cell_list.h"

namespace archetide {
namespace {

// Cells that water has come in at a cell of the side; 0 where it leaves.
double cells_come_in(const Grid& g, int side, const MacField& carrier, double dt, Vec3i cell) {
  const int axis = side / 2;
  const bool high = side % 2;
  if (high) ++cell[axis];
  const double inward = (high ? -1.0 : 1.0) * carrier[axis](cell[0], cell[1], cell[2]);
  return std::max(0.0, inward * dt / g.dx);
}

// One component of u at one side: of the point that is L cells from the outermost one what remains
// of the tank's water is 1 - (c - L), with c the cells that water has come in.
void bring_in(const Grid& g, int side, double beyond, const MacField& carrier, double dt,
              int component, Array3<double>& u) {
  const int axis = side / 2;
  const bool high = side % 2;
  Vec3i points(u.nx(), u.ny(), u.nz());
  points[axis] = 1;
  for (int k = 0; k < points[2]; ++k)
    for (int j = 0; j < points[1]; ++j)
      for (int i = 0; i < points[0]; ++i) {
        Vec3i at(i, j, k), cell = at, other = at;
        const int last = g.size(axis) - 1;
        cell[axis] = other[axis] = high ? last : 0;
        if (component != axis) {
          other[component] = std::max(at[component] - 1, 0);
          cell[component] = std::min(at[component], g.size(component) - 1);
        }
        const double come = 0.5 * (cells_come_in(g, side, carrier, dt, cell) +
                                   cells_come_in(g, side, carrier, dt, other));
        const int ends = component == axis ? last + 1 : last;
        for (int layer = 0; layer < come && layer <= ends; ++layer) {
          at[axis] = high ? ends - layer : layer;
          double& value = u(at[0], at[1], at[2]);
          value = beyond + std::clamp(1.0 - (come - layer), 0.0, 1.0) * (value - beyond);
        }
      }
}

}  // namespace

VelocityBeyond mean_at_sides(const Grid& g, const MacField& u) {
  VelocityBeyond mean;
  for (int side = 0; side < 6; ++side) {
    Vec3 sum = Vec3::Zero();
    double cells = 0.0;
    for_cells_at_side(g, side, [&](Ijk c) {
      const Vec3i low(c.i, c.j, c.k);
      for (int a = 0; a < 3; ++a) {
        const Vec3i high = low + Vec3i(Vec3i::Unit(a));
        const double first = u[a](low[0], low[1], low[2]), last = u[a](high[0], high[1], high[2]);
        sum[a] += a != side / 2 ? 0.5 * (first + last) : side % 2 ? last : first;
      }
      ++cells;
    });
    mean[side] = sum / cells;
  }
  return mean;
}

void bring_in_water(const Grid& g, const Sides& sides, const VelocityBeyond& beyond,
                    const MacField& carrier, double dt, MacField& u) {
  for (int side = 0; side < 6; ++side)
    for (int component = 0; sides[side] && component < 3; ++component)
      bring_in(g, side, beyond[side][component], carrier, dt, component, u[component]);
}

}  // namespace archetide
