#include "runtime/cut_cells/resolution.h"

#include "runtime/cut_cells/surface_sweep.h"

namespace archetide {

double thin_part(const Grid& g, const std::vector<Vec3>& points,
                 const std::vector<Vec3i>& triangles) {
  const SurfaceCells surface =
      cell_moments(g, points, triangles, std::vector<double>(points.size(), 0.0));
  // Two sides: less than half of the area is left when the normals are added up.
  double thin = 0.0, all = 0.0;
  for (std::size_t n = 0; n < surface.cells().size(); ++n) {
    const Vec3i& cell = surface.cells()[n];
    if ((cell.array() < 0).any() || cell[0] >= g.nx || cell[1] >= g.ny || cell[2] >= g.nz) continue;
    const CellMoments& m = surface.moments()[n];
    all += m.size;
    if (m.area.norm() < 0.5 * m.size) thin += m.size;
  }
  return all > 0.0 ? thin / all : 0.0;
}

}  // namespace archetide
