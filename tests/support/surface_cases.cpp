#include "tests/support/surface_cases.h"

#include <cmath>

#include "runtime/fluid/level_set.h"
#include "tests/support/fluid_fields.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

using test::kNoSolid;
using test::sample_cells;
using test::sample_faces;
using test::unit_grid;

double zalesak(const Vec3& x) {
  const double dx = x[0] - 0.5, dy = x[1] - 0.75;
  const double disk = std::hypot(dx, dy) - 0.15;
  // Slot: |x - 0.5| < 0.025, y < 0.85.
  const double slot = std::max(std::abs(dx) - 0.025, x[1] - 0.85);
  return std::max(disk, -slot);
}

}  // namespace

FluidState state_of(const Grid& g, const SurfaceOptions& options, const Array3<double>& phi,
                    const MacField& u) {
  FluidState s;
  s.phi = phi, s.u = u;
  prepare_surface(g, s, options, kNoSolid);
  return s;
}

ZalesakResult zalesak_disk(int per_cell) {
  const Grid g = unit_grid(100, 100, 4, 0.01);
  SurfaceOptions options;
  options.particles_per_cell = per_cell;
  FluidState s =
      state_of(g, options, sample_cells(g, zalesak), sample_faces(g, [](int a, const Vec3& x) {
                 return a == 0 ? 2 * M_PI * (0.5 - x[1]) : a == 1 ? 2 * M_PI * (x[0] - 0.5) : 0.0;
               }));
  const double before = water_volume(g, s.phi);
  const int steps = 314;  // at most one cell a step at the disk's rim
  for (int step = 0; step < steps; ++step)
    advance_surface(g, s, 1.0 / steps, options, kNoSolid, step);
  ZalesakResult result;
  result.area_change = water_volume(g, s.phi) / before - 1;
  for (int j = 0; j < 100; ++j)
    for (int i = 0; i < 100; ++i)
      result.misplaced += (s.phi(i, j, 2) < 0) != (zalesak(g.cell_centre(i, j, 2)) < 0);
  return result;
}

void advance_there_and_back(const Grid& g, const MacField& flow, double period, int steps,
                            const SurfaceOptions& options, FluidState& s) {
  for (int step = 0; step < steps; ++step) {
    const double factor = std::cos(M_PI * (step + 0.5) / steps);
    for (int a = 0; a < 3; ++a)
      for (std::size_t c = 0; c < flow[a].size(); ++c) s.u[a][c] = factor * flow[a][c];
    advance_surface(g, s, period / steps, options, kNoSolid, step);
  }
}

double enright_volume_change(int n, int per_cell) {
  const Grid g = unit_grid(n, n, n, 1.0 / n);
  SurfaceOptions options;
  options.particles_per_cell = per_cell;
  // Sampled at the faces: the discrete divergence is O(dx^2).
  const MacField flow = sample_faces(g, [](int a, const Vec3& x) {
    const auto s = [](double t) { return std::sin(M_PI * t); };
    const auto s2 = [](double t) { return std::sin(2 * M_PI * t); };
    return a == 0   ? 2 * s(x[0]) * s(x[0]) * s2(x[1]) * s2(x[2])
           : a == 1 ? -s2(x[0]) * s(x[1]) * s(x[1]) * s2(x[2])
                    : -s2(x[0]) * s2(x[1]) * s(x[2]) * s(x[2]);
  });
  FluidState s = state_of(
      g, options,
      sample_cells(g, [](const Vec3& x) { return test::sphere(x, Vec3(0.35, 0.35, 0.35), 0.15); }),
      flow);
  const double before = water_volume(g, s.phi), period = 3.0;
  advance_there_and_back(g, flow, period, 6 * n, options, s);  // CFL 1 at speed 2
  return water_volume(g, s.phi) / before - 1;
}

}  // namespace archetide
