#include "runtime/coupling/resolution.h"

#include "runtime/coupling/surface_sweep.h"

namespace archetide {

double thin_part(const Grid& g, const std::vector<Vec3>& points,
                 const std::vector<Vec3i>& triangles) {
  const CellBox box = cell_box(g, points);
  const std::vector<CellMoments> moments =
      cell_moments(g, box, points, triangles, std::vector<double>(points.size(), 0.0));
  // Two sides: less than half of the area is left when the normals are added up.
  double thin = 0.0, all = 0.0;
  const Vec3i low = box.low.cwiseMax(0),
              high = (box.low + box.size).cwiseMin(Vec3i(g.nx, g.ny, g.nz));
  for (int n = low[2]; n < high[2]; ++n)
    for (int j = low[1]; j < high[1]; ++j)
      for (int i = low[0]; i < high[0]; ++i) {
        const CellMoments& m = moments[box.index({i, j, n})];
        all += m.size;
        if (m.area.norm() < 0.5 * m.size) thin += m.size;
      }
  return all > 0.0 ? thin / all : 0.0;
}

}  // namespace archetide
