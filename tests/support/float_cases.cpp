#include "tests/support/float_cases.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/gauge.h"
#include "tests/support/constants.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/float_draft.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

int most_iterations(const StepReport& r, int before) {
  return std::max({before, r.position.iterations, r.velocity.iterations});
}

}  // namespace

FloatResult floating_sphere(int cells_per_radius, double ratio, double end) {
  constexpr double kRadius = 0.2, kLevel = 0.6;  // m
  SimulationOptions o;
  const int n = 5 * cells_per_radius;
  o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.max_dt = 0.02;
  const auto sphere =
      rigid_surface_archetype(volume_true_sphere(4, kRadius), ratio * kWaterDensity);
  ReducedBody body = make_body(sphere, 0);
  const double draft = exact_draft(ratio);
  body.position = Vec3(0.503, 0.496, kLevel + kRadius * (1.0 - draft + 0.1));
  Simulation simulation(o, water_to(o.grid, kLevel), {body}, {});
  FloatResult result;
  double seconds = 0.0;
  while (simulation.time() < end - 1e-9) {
    const StepReport r = simulation.step(std::min(simulation.stable_dt(), end - simulation.time()));
    ++result.steps, result.iterations = most_iterations(r, result.iterations);
    if (r.t < 2.0 / 3.0 * end) continue;
    const double level = r.water_volume + sphere->integrals.mass / kWaterDensity;  // of 1 m^2
    result.draft += r.dt * (level - simulation.bodies()[0].position[2] + kRadius) / kRadius;
    seconds += r.dt;
  }
  result.draft /= seconds;
  return result;
}

Heave heaving_sphere(int cells_per_radius, double share) {
  constexpr double kRadius = 0.2, kRaised = 0.05;  // m; radii
  SimulationOptions o;
  const int across = 24 * cells_per_radius;
  o.grid = {across, across, 14 * cells_per_radius, kRadius / cells_per_radius, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.max_dt = 1.0;
  const double g = o.gravity.norm(), beat = std::sqrt(kRadius / g), level = 12.0 * kRadius;
  ReducedBody body =
      make_body(rigid_surface_archetype(volume_true_sphere(4, kRadius), 0.5 * kWaterDensity), 0);
  body.position =
      Vec3(0.503 * across * o.grid.dx, 0.496 * across * o.grid.dx, level + kRaised * kRadius);
  Simulation simulation(o, water_to(o.grid, level), {body}, {});
  Heave result;
  const double dt = share * simulation.stable_dt();
  std::vector<double> z = {1.0, 1.0};  // two places before and now; at rest before it is let go
  int found = 0;
  while (found < 2 && simulation.time() < 8.0 * beat) {
    const StepReport r = simulation.step(dt);
    ++result.steps, result.iterations = most_iterations(r, result.iterations);
    const double now = (simulation.bodies()[0].position[2] - level) / (kRaised * kRadius);
    const double before = z[0], middle = z[1];
    if (result.steps > 1 && (now - middle) * (middle - before) <= 0.0) {  // vertex of a parabola
      const double bend = 0.5 * (now - 2.0 * middle + before), slope = 0.5 * (now - before);
      const double at = -0.5 * slope / bend;
      result.time[found] = (r.t - dt + at * dt) / beat;
      result.height[found++] = middle + 0.5 * slope * at;
    }
    z = {middle, now};
  }
  return result;
}

TankMomentum closed_tank_momentum(int cells_per_radius) {
  SimulationOptions o;
  const int n = 5 * cells_per_radius;
  o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.gravity = Vec3::Zero();
  o.tolerance = 1e-12;
  const auto sphere = rigid_surface_archetype(volume_true_sphere(4, 0.2), 0.5 * kWaterDensity);
  ReducedBody body = make_body(sphere, 0);
  body.position = Vec3(0.4, 0.47, 0.45);
  body.P = sphere->integrals.mass * Vec3(1.0, 0.3, 0.5);
  Simulation simulation(o, water_to(o.grid, INFINITY), {body}, {});
  TankMomentum result;
  for (int step = 0; step < 20; ++step) {
    const StepReport r = simulation.step(0.5 * o.grid.dx);
    result.iterations = most_iterations(r, result.iterations);
    const Vec3 v = simulation.bodies()[0].P / sphere->integrals.mass;
    const Vec3 displaced = kWaterDensity * sphere->volume * v;
    result.worst = std::max(result.worst, (r.water_momentum + displaced).norm() / displaced.norm());
  }
  return result;
}

double velocity_off_rigid(double first_omega) {
  SyntheticOptions options;
  options.density = 0.5 * kWaterDensity;
  options.first_omega = first_omega;
  const auto blob =
      deformable_archetype(blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(4, 3, 3)), options);
  const auto velocity = [&](int modes) -> VecX {
    CoupledTank tank(20, 0.5);
    tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
    tank.options.open_side[kZMax] = true;
    tank.bodies.push_back(make_body(blob.archetype, modes));
    tank.solve(0.01);
    return tank.results[0].y.head(6);
  };
  const VecX rigid = velocity(0);
  return (velocity(options.r) - rigid).norm() / rigid.norm();
}

BoxImpact dam_break_on_box(int n) {
  SimulationOptions o;
  const double dx = 3.22 / n;
  const int across = static_cast<int>(std::lround(1.0 / dx));
  o.grid = {n, across, across, dx, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  const double middle = 0.5 * across * dx;
  const TriMesh box =
      box_between(Vec3(0.6635, middle - 0.2015, -0.05), Vec3(0.8245, middle + 0.2015, 0.161));
  Simulation simulation(o,
                        water_where(o.grid,
                                    [](const Vec3& x) {
                                      const double left = 1.992 - x[0], up = x[2] - 0.55;
                                      return left > 0 && up > 0 ? std::hypot(left, up)
                                                                : std::max(left, up);
                                    }),
                        {}, {box});
  BoxImpact result;
  struct Pressure {
    double time, dt, value;  // s, s, Pa
  };
  std::vector<Pressure> bearing;  // of P1, until 0.5 s
  const Vec3 p1(0.8245, middle - 0.026, 0.021);
  double before = 0.0, time_before = 0.0, first = 0.0, lowest = INFINITY, fall = 0.0;
  for (int tenth = 4; tenth <= 20; ++tenth) {
    const double stop = 0.1 * tenth;
    double shown = 0.0;
    while (simulation.time() < stop - 1e-9) {
      const StepReport r =
          simulation.step(std::min(simulation.stable_dt(), stop - simulation.time()));
      result.iterations = most_iterations(r, result.iterations);
      shown = r.accounted_volume();
      const double all = shown + r.volume_residual, energy = r.water_kinetic + r.potential;
      if (result.steps++ == 0) first = all, fall = energy;
      result.kept = std::max(result.kept, std::abs(all / first - 1.0));
      lowest = std::min(lowest, energy);
      result.energy_rise = std::max(result.energy_rise, energy - lowest);
      if (r.t > 0.5 + 1e-9) continue;
      bearing.push_back({r.t, r.dt, read_gauge(simulation, r.dt, p1).pressure.value_or(0.0)});
      const double h2 = water_height(simulation.grid(), simulation.fluid().phi, 0.992, middle);
      if (result.passes == 0.0 && h2 >= 0.05)
        result.passes = time_before + (r.t - time_before) * (0.05 - before) / (h2 - before);
      before = h2, time_before = r.t;
    }
    result.shown = std::max(result.shown, std::abs(shown / first - 1.0));
    const double h4 = water_height(simulation.grid(), simulation.fluid().phi, 2.638, middle);
    if (tenth == 4) result.h4_04 = h4;
    if (tenth == 5) result.h4_05 = h4, result.h2_05 = before;
  }
  result.energy_rise /= fall - lowest;
  double weight = 0.0;
  for (const Pressure& p : bearing) {
    result.p1_peak = std::max(result.p1_peak, p.value);
    if (p.time > 0.49) result.p1_05 += p.dt * p.value, weight += p.dt;
  }
  result.p1_05 /= weight;
  for (const Pressure& p : bearing)
    if (result.struck == 0.0 && p.value >= 0.25 * result.p1_peak) result.struck = p.time;
  return result;
}

}  // namespace archetide
