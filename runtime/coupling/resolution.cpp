#include "runtime/coupling/resolution.h"

#include "runtime/coupling/clip.h"
#include "runtime/coupling/surface_sweep.h"

namespace archetide {

double thin_part(const Grid& g, const std::vector<Vec3>& points,
                 const std::vector<Vec3i>& triangles) {
  const CellBox box = cell_box(g, points);
  std::vector<CellMoments> moments(box.count());
  for (const Vec3i& t : triangles) {
    Vec3 x[3];
    for (int v = 0; v < 3; ++v) x[v] = (points[t[v]] - g.origin) / g.dx;
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const bool inside =
          (cell.array() >= 0).all() && cell[0] < g.nx && cell[1] < g.ny && cell[2] < g.nz;
      if (inside) moments[box.index(cell)].add(vector_area(piece), 0.0, 0.0);
    });
  }
  // Two sides: less than half of the area is left when the normals are added up.
  double thin = 0.0, all = 0.0;
  for (const CellMoments& m : moments) {
    all += m.size;
    if (m.area.norm() < 0.5 * m.size) thin += m.size;
  }
  return all > 0.0 ? thin / all : 0.0;
}

}  // namespace archetide
