#include "runtime/fluid/markers.h"

#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

constexpr double kWallGap = 1e-6;  // points stay this far inside the tank, dx

struct Inside {
  Vec3 low, high;
  explicit Inside(const Grid& g)
      : low(g.low() + Vec3::Constant(kWallGap * g.dx)),
        high(g.high() - Vec3::Constant(kWallGap * g.dx)) {}
  Vec3 operator()(const Vec3& x) const { return x.cwiseMax(low).cwiseMin(high); }
};

}  // namespace

void advect_points(const Grid& g, const MacField& u, double dt, std::vector<Vec3>& points) {
  const MacSampler sampler(g, u);
  const Inside in_tank(g);
  const double h = dt / g.dx;
#pragma omp parallel for
  for (std::size_t t = 0; t < points.size(); ++t) {
    const Vec3 c = (points[t] - g.origin) / g.dx;
    const Axes x = {c[0], c[1], c[2], 0.0};
    Axes v, v_mid;
    sampler.at(x, v);
    sampler.at(x + 0.5 * h * v, v_mid);
    points[t] = in_tank(points[t] + dt * Vec3(v_mid[0], v_mid[1], v_mid[2]));
  }
}

void return_to_water(const Grid& g, const Array3<double>& phi, std::vector<Vec3>& points) {
  constexpr int kTurns = 3;        // phi is a distance, but bends
  constexpr double kDepth = 0.01;  // below the surface, dx
  const Inside in_tank(g);
#pragma omp parallel for
  for (std::size_t t = 0; t < points.size(); ++t)
    for (int turn = 0; turn < kTurns; ++turn) {
      const double above = interpolate(g, phi, points[t]);
      if (above <= 0.0) break;
      const Vec3 up = interpolate_gradient(g, phi, points[t]).stableNormalized();
      points[t] = in_tank(points[t] - (above + kDepth * g.dx) * up);
    }
}

}  // namespace archetide
