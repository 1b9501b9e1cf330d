#include "tests/support/violent_cases.h"

#include <algorithm>
#include <cmath>

#include "runtime/fluid/level_set.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

SimulationOptions tank(int n, double cfl, double deep) {
  SimulationOptions o;
  o.grid = {2 * n, static_cast<int>(std::lround(deep * n)), 3 * n / 2, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.cfl = cfl;
  o.tolerance = 1e-6;
  return o;
}

// Volume of the water with x > 1 m.
double far_volume(const Grid& g, const Array3<double>& phi) {
  double sum = 0.0;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i)
        if (g.cell_centre(i, j, k)[0] > 1.1)
          sum += wet_fraction(g, phi, i, j, k, phi.index(i, j, k));
  return sum;
}

ViolentResult watch(Simulation& simulation, double end) {
  constexpr double kFrame = 1.0 / 24;
  ViolentResult result;
  double first = 0.0, energy = 0.0;
  const double calm = far_volume(simulation.grid(), simulation.fluid().phi);
  for (int frame = 1; simulation.time() < end - 1e-9; ++frame) {
    const double stop = std::min(frame * kFrame, end);
    double shown = 0.0;
    while (simulation.time() < stop - 1e-9) {
      const double left = stop - simulation.time();
      const StepReport r = simulation.step(left / std::ceil(left / simulation.stable_dt() - 1e-9));
      shown = r.accounted_volume();
      const double now = r.water_kinetic + r.potential;
      if (result.steps++ == 0) first = shown + r.volume_residual, energy = now;
      result.kept = std::max(result.kept, std::abs((shown + r.volume_residual) / first - 1.0));
      result.energy_rise = std::max(result.energy_rise, now / energy - 1.0);
      result.speed = std::max(result.speed, r.max_speed);
      result.iterations =
          std::max({result.iterations, r.position.iterations, r.velocity.iterations});
    }
    result.shown = std::max(result.shown, std::abs(shown / first - 1.0));
    if (calm > 0.0)
      result.calm_level =
          std::max(result.calm_level,
                   std::abs(far_volume(simulation.grid(), simulation.fluid().phi) / calm - 1.0));
  }
  return result;
}

}  // namespace

ViolentResult collapse(int n, double cfl, double deep) {
  const SimulationOptions o = tank(n, cfl, deep);
  Simulation simulation(o,
                        water_where(o.grid,
                                    [](const Vec3& x) {
                                      return box_distance(x, {-9, -9, -9}, {0.6, 9, 1.0});
                                    }),
                        {}, {});
  return watch(simulation, 1.5);
}

ViolentResult two_pools(int n, double cfl, double end) {
  const SimulationOptions o = tank(n, cfl, 1.0);
  const TriMesh wall = box_between({0.9, -0.1, -0.1}, {1.1, 1.1, 1.7});
  Simulation simulation(
      o,
      water_where(o.grid,
                  [](const Vec3& x) {
                    return std::min(x[2] - 0.4,
                                    box_distance(x, {0.2, 0.2, 0.7}, {0.7, 0.8, 1.1}));
                  }),
      {}, {wall});
  return watch(simulation, end);
}

}  // namespace archetide
