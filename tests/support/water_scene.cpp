#include "tests/support/water_scene.h"

#include <cmath>

namespace archetide {

FluidState water_where(const Grid& g, const std::function<double(const Vec3&)>& phi) {
  FluidState s;
  s.phi.resize(g.nx, g.ny, g.nz);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) s.phi(i, j, k) = phi(g.cell_centre(i, j, k));
  return s;
}

FluidState water_to(const Grid& g, double level) {
  return water_where(g, [&](const Vec3& x) { return std::isinf(level) ? -1e3 : x[2] - level; });
}

void set_velocity(const Grid& g, const std::function<Vec3(const Vec3&)>& v, FluidState& state) {
  state.u.resize(g);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < state.u[a].nz(); ++k)
      for (int j = 0; j < state.u[a].ny(); ++j)
        for (int i = 0; i < state.u[a].nx(); ++i)
          state.u[a](i, j, k) = v(g.face_centre(a, i, j, k))[a];
}

double box_distance(const Vec3& x, const Vec3& low, const Vec3& high) {
  const Vec3 out = (low - x).cwiseMax(x - high);
  const double inside = out.maxCoeff();
  return inside <= 0.0 ? inside : out.cwiseMax(0.0).norm();
}

double water_height(const Grid& g, const Array3<double>& phi, double x, double y) {
  double height = 0.0, last = interpolate(g, phi, Vec3(x, y, g.low()[2] + 0.5 * g.dx));
  if (last >= 0.0) return 0.0;
  for (double s = 0.75 * g.dx; s < g.high()[2] - g.low()[2]; s += 0.25 * g.dx) {
    const double here = interpolate(g, phi, Vec3(x, y, g.low()[2] + s));
    if (here >= 0.0) return s - 0.25 * g.dx * here / (here - last);
    last = here, height = s;
  }
  return height;
}

}  // namespace archetide
