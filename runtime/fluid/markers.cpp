#include "runtime/fluid/markers.h"

#include "runtime/fluid/point_block.h"
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

// What moves points: velocity u over dt.
struct Carrier {
  const Grid& g;
  double dt;
  MacSampler sampler;
  Inside in_tank;

  Carrier(const Grid& grid, const MacField& field, double duration)
      : g(grid), dt(duration), sampler(grid, field), in_tank(grid) {}

  void move(Vec3& point) const {
    const Vec3 c = (point - g.origin) / g.dx;
    const Axes x = {c[0], c[1], c[2], 0.0};
    Axes v, v_mid;
    sampler.at(x, v);
    sampler.at(x + 0.5 * dt / g.dx * v, v_mid);
    point = in_tank(point + dt * Vec3(v_mid[0], v_mid[1], v_mid[2]));
  }

  // Eight points; false where they are too far apart for this.
  bool move_block(Vec3* points) const {
    Block x[3], at[3], v[3];
    load_points(points, x);
    for (int a = 0; a < 3; ++a) at[a] = (x[a] - g.origin[a]) / g.dx;
    if (!velocity_shared(sampler, at, v)) return false;
    for (int a = 0; a < 3; ++a) at[a] += 0.5 * dt / g.dx * v[a];
    if (!velocity_shared(sampler, at, v)) return false;
    for (int a = 0; a < 3; ++a) x[a] += dt * v[a];
    for (int l = 0; l < kBlock; ++l) points[l] = in_tank(Vec3(x[0][l], x[1][l], x[2][l]));
    return true;
  }
};

}  // namespace

void advect_points(const Grid& g, const MacField& u, double dt, std::vector<Vec3>& points) {
  const Carrier carrier(g, u, dt);
  const std::size_t blocks = points.size() / kBlock;
#pragma omp parallel for
  for (std::size_t b = 0; b < blocks; ++b) {
    Vec3* block = points.data() + b * kBlock;
    if (carrier.move_block(block)) continue;
    for (int l = 0; l < kBlock; ++l) carrier.move(block[l]);
  }
  for (std::size_t t = blocks * kBlock; t < points.size(); ++t) carrier.move(points[t]);
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
