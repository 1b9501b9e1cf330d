#include "runtime/cut_cells/cell_box.h"

#include <algorithm>
#include <cmath>

namespace archetide {

CellBox cell_box(const Grid& g, const std::vector<Vec3>& points) {
  Vec3 lo = Vec3::Constant(INFINITY), hi = -lo;
  for (const Vec3& p : points) lo = lo.cwiseMin(p), hi = hi.cwiseMax(p);
  CellBox box;
  for (int a = 0; a < 3; ++a) {
    const auto cell = [&](double x, int more) {
      return static_cast<int>(
          std::clamp(std::floor((x - g.origin[a]) / g.dx) + more, -1.0, double(g.size(a))));
    };
    box.low[a] = cell(lo[a], -1);
    box.size[a] = cell(hi[a], 1) - box.low[a] + 1;
  }
  return box;
}

CellBox whole_box(const Grid& g) { return {Vec3i::Zero(), Vec3i(g.nx, g.ny, g.nz)}; }

}  // namespace archetide
