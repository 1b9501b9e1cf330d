#include "runtime/fluid/markers.h"

#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

constexpr double kWallGap = 1e-6;  // points stay this far inside the tank, dx

Vec3 in_tank(const Grid& g, const Vec3& x) {
  const Vec3 gap = Vec3::Constant(kWallGap * g.dx);
  return x.cwiseMax(g.low() + gap).cwiseMin(g.high() - gap);
}

}  // namespace

void advect_points(const Grid& g, const MacField& u, double dt, std::vector<Vec3>& points) {
  const MacSampler sampler(g, u);
  const double h = dt / g.dx;
#pragma omp parallel for
  for (std::size_t t = 0; t < points.size(); ++t) {
    const Vec3 c = (points[t] - g.origin) / g.dx;
    double v[3], v_mid[3];
    sampler(c[0], c[1], c[2], v);
    sampler(c[0] + 0.5 * h * v[0], c[1] + 0.5 * h * v[1], c[2] + 0.5 * h * v[2], v_mid);
    points[t] = in_tank(g, points[t] + dt * Vec3(v_mid[0], v_mid[1], v_mid[2]));
  }
}

void return_to_water(const Grid& g, const Array3<double>& phi, std::vector<Vec3>& points) {
  constexpr int kTurns = 3;        // phi is a distance, but bends
  constexpr double kDepth = 0.01;  // below the surface, dx
#pragma omp parallel for
  for (std::size_t t = 0; t < points.size(); ++t)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double above = interpolate(g, phi, points[t]);
      if (above <= 0.0) break;
      const Vec3 up = interpolate_gradient(g, phi, points[t]).stableNormalized();
      points[t] = in_tank(g, points[t] - (above + kDepth * g.dx) * up);
    }
}

}  // namespace archetide
