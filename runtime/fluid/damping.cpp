#include "runtime/fluid/damping.h"

#include <cmath>
#include <vector>

namespace archetide {
namespace {

// s^2 of the points of component A along axis B: of the nearer side.
std::vector<double> strength(const Grid& g, const Damping& beach, int component, int axis) {
  const int points = g.size(axis) + (component == axis);
  const double first = component == axis ? 0.0 : 0.5, length = g.dx * g.size(axis);
  std::vector<double> result(points);
  for (int p = 0; p < points; ++p) {
    const double x = g.dx * (p + first);
    for (const int side : {0, 1}) {
      const double width = beach.width[2 * axis + side], gap = side == 0 ? x : length - x;
      if (gap >= width) continue;
      const double s = 1.0 - gap / width;
      result[p] = std::max(result[p], s * s);
    }
  }
  return result;
}

// Of both cells of a face.
double mean_held(const Array3<double>& held, int axis, Vec3i cell) {
  double sum = 0.0;
  for (int side = 0; side < 2; ++side, --cell[axis])
    if (held.contains(cell[0], cell[1], cell[2])) sum += 0.5 * held(cell[0], cell[1], cell[2]);
  return sum;
}

}  // namespace

double damp(const Grid& g, const Damping& damping, double dt,
            const FaceField<unsigned char>& target, const Array3<double>& held, MacField& u) {
  double taken = 0.0;
  for (int a = 0; a < 3; ++a) {
    std::vector<double> planes(u[a].nz(), 0.0);
    const std::vector<double> x = strength(g, damping, a, 0), y = strength(g, damping, a, 1);
    const auto kept = [&](double s2) { return std::exp(-dt * (damping.drag + damping.rate * s2)); };
    std::vector<double> at_x;
    for (const double s2 : x) at_x.push_back(kept(s2));
#pragma omp parallel for
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j) {
        const double at_y = kept(y[j]);
        const std::size_t n = u[a].index(0, j, k);
        for (int i = 0; i < u[a].nx(); ++i) {
          if (!target[a][n + i]) continue;
          const double left = std::min(at_x[i], at_y), before = u[a][n + i];
          u[a][n + i] = left * before;
          planes[k] += 0.5 * mean_held(held, a, {i, j, k}) * (1.0 - left * left) * before * before;
        }
      }
    for (const double plane : planes) taken += plane;
  }
  return taken * g.dx * g.dx * g.dx;
}

}  // namespace archetide
