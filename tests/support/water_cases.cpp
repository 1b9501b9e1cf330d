#include "tests/support/water_cases.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "runtime/fluid/level_set.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

SimulationOptions weightless_box(const Grid& g) {
  SimulationOptions o;
  o.grid = g;
  o.has_water = true;
  o.gravity = Vec3::Zero();
  o.max_dt = 1e9;
  return o;
}

int most_iterations(const StepReport& r, int before) {
  return std::max({before, r.position.iterations, r.velocity.iterations});
}

struct Progress {
  int steps = 0, iterations = 0;
};
// Runs to `end` in equal steps of at most `step`.
Progress run_evenly(Simulation& simulation, double end, double step) {
  const double left = end - simulation.time();
  Progress p;
  p.steps = static_cast<int>(std::ceil(left / step - 1e-9));
  for (int n = 0; n < p.steps; ++n)
    p.iterations = most_iterations(simulation.step(left / p.steps), p.iterations);
  return p;
}

double kinetic_energy(const MacField& u) {
  double sum = 0.0;
  for (int a = 0; a < 2; ++a)
    for (std::size_t n = 0; n < u[a].size(); ++n) sum += u[a][n] * u[a][n];
  return sum;
}

MacField difference(MacField u, const MacField& v) {
  for (int a = 0; a < 2; ++a)
    for (std::size_t n = 0; n < u[a].size(); ++n) u[a][n] -= v[a][n];
  return u;
}

// Distance from `from` along +axis to the zero of phi, linear between cell centres, m.
double extent(const Grid& g, const Array3<double>& phi, const Vec3& from, int axis) {
  double last = interpolate(g, phi, from);
  for (double s = 0.25 * g.dx;; s += 0.25 * g.dx) {
    const double here = interpolate(g, phi, from + s * Vec3::Unit(axis));
    if (here >= 0.0 || s > 1e3 * g.dx * g.nx) return s - 0.25 * g.dx * here / (here - last);
    last = here;
  }
}

}  // namespace

VortexResult taylor_green(int n, double cfl, Scheme scheme) {
  SimulationOptions o = weightless_box({n, n, 1, 2.0 * M_PI / n, Vec3::Zero()});
  o.scheme = scheme;
  o.cfl = 2.0 * cfl;
  FluidState start = water_to(o.grid, INFINITY);
  const auto exact = [](const Vec3& x) {
    return Vec3(std::sin(x[0]) * std::cos(x[1]), -std::cos(x[0]) * std::sin(x[1]), 0.0);
  };
  set_velocity(o.grid, exact, start);
  const MacField u0 = start.u;
  Simulation simulation(o, std::move(start), {}, {});
  VortexResult result;
  const Progress progress = run_evenly(simulation, 2.0 * M_PI, cfl * o.grid.dx);
  result.steps = progress.steps, result.iterations = progress.iterations;
  const MacField& u = simulation.fluid().u;
  result.energy_change = kinetic_energy(u) / kinetic_energy(u0) - 1.0;
  result.velocity_error = std::sqrt(kinetic_energy(difference(u, u0)) / (n * n));
  return result;
}

CarriedVortexResult carried_vortex(int n, double cfl, Scheme scheme) {
  constexpr double kCore = 0.06, kEnd = 0.5, kFastest = 2.2;  // stream and vortex together
  const Vec3 stream(1.0, 0.5, 0.0), from(0.35, 0.325, 0.0);
  SimulationOptions o = weightless_box({6 * n / 5, 9 * n / 10, 1, 1.0 / n, Vec3::Zero()});
  o.open_side = {true, true, true, true, false, false};
  o.scheme = scheme;
  o.cfl = 2.0 * cfl;
  const auto vortex_at = [&](double t) {
    return [=](const Vec3& x) -> Vec3 {
      const Vec3 d = (x - from - t * stream) / kCore;
      const double r2 = d[0] * d[0] + d[1] * d[1];
      return std::exp(0.5 * (1.0 - r2)) * Vec3(-d[1], d[0], 0.0);
    };
  };
  const auto field = [&](const std::function<Vec3(const Vec3&)>& v) {
    FluidState s = water_to(o.grid, INFINITY);
    set_velocity(o.grid, v, s);
    return s;
  };
  const auto start = vortex_at(0.0), end = vortex_at(kEnd);
  Simulation simulation(o, field([&](const Vec3& x) -> Vec3 { return stream + start(x); }), {}, {});
  CarriedVortexResult result;
  const Progress progress = run_evenly(simulation, kEnd, cfl * o.grid.dx / kFastest);
  result.steps = progress.steps, result.iterations = progress.iterations;
  const double energy = kinetic_energy(field(start).u);
  const auto without = [&](const std::function<Vec3(const Vec3&)>& v) {
    return kinetic_energy(difference(simulation.fluid().u, field(v).u));
  };
  result.velocity_error =
      std::sqrt(without([&](const Vec3& x) -> Vec3 { return stream + end(x); }) / energy);
  result.energy_change = without([&](const Vec3&) { return stream; }) / energy - 1.0;
  return result;
}

VecX unsteady_vortices(int n, double cfl) {
  SimulationOptions o = weightless_box({n, n, 1, M_PI / n, Vec3::Zero()});
  o.cfl = 4.0 * cfl;
  FluidState start = water_to(o.grid, INFINITY);
  set_velocity(
      o.grid,
      [](const Vec3& x) {
        const double sx = std::sin(x[0]), s2x = std::sin(2 * x[0]);
        return Vec3((sx + s2x) * std::cos(x[1]),
                    -(std::cos(x[0]) + 2 * std::cos(2 * x[0])) * std::sin(x[1]), 0.0);
      },
      start);
  Simulation simulation(o, std::move(start), {}, {});
  run_evenly(simulation, 1.0, cfl * o.grid.dx / 3.0);
  VecX probes(18);
  for (int p = 0; p < 9; ++p) {
    const Vec3 x(M_PI / 4 * (1 + p % 3), M_PI / 4 * (1 + p / 3), 0.5 * o.grid.dx);
    for (int a = 0; a < 2; ++a)
      probes[2 * p + a] = interpolate_component(simulation.grid(), simulation.fluid().u, a, x);
  }
  return probes;
}

double still_tank_speed(int particles) {
  SimulationOptions o;
  o.grid = {16, 16, 16, 1.0 / 16, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.particles_per_cell = particles;
  const double level = 0.53137;
  Simulation simulation(o, water_to(o.grid, level), {}, {});
  double fastest = 0.0;
  for (int n = 0; n < 1000; ++n) fastest = std::max(fastest, simulation.step(0.02).max_speed);
  return fastest / std::sqrt(9.81 * level);
}

FrontResult column_collapse(int n, double end) {
  const double a = 0.05715, dx = a / n;
  SimulationOptions o;
  o.grid = {5 * n, 1, 5 * n / 2, dx, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  Simulation simulation(o,
                        water_where(o.grid,
                                    [&](const Vec3& x) {
                                      const double right = x[0] - a, up = x[2] - 2 * a;
                                      const bool corner = right > 0 && up > 0;
                                      return corner ? std::hypot(right, up) : std::max(right, up);
                                    }),
                        {}, {});
  FrontResult result;
  while (simulation.time() < end - 1e-9) {
    const StepReport r = simulation.step(std::min(simulation.stable_dt(), end - simulation.time()));
    ++result.steps;
    result.iterations = most_iterations(r, result.iterations);
    const Vec3 corner = o.grid.cell_centre(0, 0, 0);
    result.time.push_back(simulation.time());
    result.front.push_back(corner[0] +
                           extent(simulation.grid(), simulation.fluid().phi, corner, 0));
    result.height.push_back(corner[2] +
                            extent(simulation.grid(), simulation.fluid().phi, corner, 2));
  }
  return result;
}

SteepWavesResult steep_waves(int n, double amplitude, bool ball) {
  SimulationOptions o;
  o.grid = {n, n, 3 * n / 2, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  FluidState start = water_where(o.grid, [&](const Vec3& x) {
    const double ex = std::cos(M_PI * x[0]), ey = 0.6 * std::cos(2.0 * M_PI * x[1]);
    const double sx = -M_PI * amplitude * std::sin(M_PI * x[0]),
                 sy = -1.2 * M_PI * amplitude * std::sin(2.0 * M_PI * x[1]);
    return (x[2] - 0.5 - amplitude * (ex + ey)) / std::sqrt(1.0 + sx * sx + sy * sy);
  });
  std::vector<ReducedBody> bodies;
  if (ball) {
    bodies.push_back(make_body(rigid_surface_archetype(icosphere(3, 0.2), 500.0), 0));
    bodies[0].position = Vec3(0.503, 0.497, 0.51);
  }
  Simulation simulation(o, std::move(start), std::move(bodies), {});
  const double before =
      water_volume(simulation.grid(), simulation.fluid().phi, &simulation.coupling().solids().cell);
  SteepWavesResult result;
  constexpr double kEnd = 2.0;
  while (simulation.time() < kEnd - 1e-9) {
    const StepReport r =
        simulation.step(std::min(simulation.stable_dt(), kEnd - simulation.time()));
    result.volume_change = r.water_volume / before - 1.0;
    ++result.steps;
  }
  return result;
}

SloshResult sloshing(int n, double max_dt, int particles, const Damping& damping) {
  SimulationOptions o;
  o.grid = {n, 1, 3 * n / 4, 1.0 / n, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.max_dt = max_dt;
  o.particles_per_cell = particles;
  o.damping = damping;
  const double depth = 0.5, amplitude = 0.01, period = 1.181815523;
  FluidState start = water_where(
      o.grid, [&](const Vec3& x) { return x[2] - depth - amplitude * std::cos(M_PI * x[0]); });
  Simulation simulation(o, std::move(start), {}, {});
  const auto mode = [&] {
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      const Vec3 foot = o.grid.cell_centre(i, 0, 0);
      const double height = foot[2] + extent(simulation.grid(), simulation.fluid().phi, foot, 2);
      sum += 2.0 / n * (height - depth) * std::cos(M_PI * foot[0]);
    }
    return sum;
  };
  std::vector<double> t{0.0}, a{mode()};
  SloshResult result;
  while (simulation.time() < 3.3 * period) {
    const StepReport r = simulation.step(std::min(simulation.stable_dt(), max_dt));
    result.iterations = most_iterations(r, result.iterations);
    t.push_back(simulation.time()), a.push_back(mode());
    ++result.steps;
  }
  // Downward zero crossings and the extreme between each pair: parabola through three points.
  std::vector<double> crossing, peak{a[0]};
  for (std::size_t s = 1; s < t.size(); ++s)
    if (a[s - 1] > 0 && a[s] <= 0)
      crossing.push_back(t[s - 1] + (t[s] - t[s - 1]) * a[s - 1] / (a[s - 1] - a[s]));
  for (std::size_t s = 1; s + 1 < t.size(); ++s)
    if (a[s] > 0 && a[s] >= a[s - 1] && a[s] > a[s + 1]) {
      const double curvature = a[s - 1] - 2 * a[s] + a[s + 1], slope = 0.5 * (a[s + 1] - a[s - 1]);
      peak.push_back(a[s] - 0.5 * slope * slope / curvature);
    }
  result.period = (crossing.back() - crossing.front()) / (crossing.size() - 1.0);
  result.decay = 1.0 - std::pow(peak.back() / peak.front(), 1.0 / (peak.size() - 1.0));
  return result;
}

DropResult elliptic_drop(int n, double cfl, int particles) {
  const double dx = 1.0 / n;
  SimulationOptions o = weightless_box({9 * n, 3 * n, 1, dx, Vec3(-4.5, -1.5, 0.0)});
  o.open_side = {true, true, true, true, false, false};
  o.particles_per_cell = particles;
  o.cfl = cfl;
  FluidState start =
      water_where(o.grid, [](const Vec3& x) { return std::hypot(x[0], x[1]) - 1.0; });
  set_velocity(
      o.grid, [](const Vec3& x) { return Vec3(x[0], -x[1], 0.0); }, start);
  Simulation simulation(o, std::move(start), {}, {});
  DropResult result;
  const Vec3 centre(0, 0, 0.5 * dx);
  double volume = 0.0;
  for (int stop = 0; stop < 2; ++stop) {
    while (simulation.time() < 1.0 + stop - 1e-9) {
      const StepReport r =
          simulation.step(std::min(simulation.stable_dt(), 1.0 + stop - simulation.time()));
      if (result.steps++ == 0) volume = r.water_volume;
      result.volume_change = r.water_volume / volume - 1.0;
      result.iterations = most_iterations(r, result.iterations);
    }
    result.long_axis[stop] = extent(simulation.grid(), simulation.fluid().phi, centre, 0);
    result.short_axis[stop] = extent(simulation.grid(), simulation.fluid().phi, centre, 1);
  }
  return result;
}

DropResult spheroid_drop(int n, double cfl, int particles, double sign) {
  const double dx = 1.0 / n;
  const int half_z = sign > 0 ? 5 * n / 2 : 3 * n / 2, half_x = sign > 0 ? 3 * n / 2 : 2 * n;
  const Vec3 corner(-dx * half_x, -dx * half_x, -dx * half_z);
  SimulationOptions o = weightless_box({2 * half_x, 2 * half_x, 2 * half_z, dx, corner});
  o.open_side.fill(true);
  o.particles_per_cell = particles;
  o.cfl = cfl;
  FluidState start = water_where(o.grid, [](const Vec3& x) { return x.norm() - 1.0; });
  set_velocity(
      o.grid,
      [&](const Vec3& x) { return Vec3(-0.5 * sign * x[0], -0.5 * sign * x[1], sign * x[2]); },
      start);
  Simulation simulation(o, std::move(start), {}, {});
  DropResult result;
  double volume = 0.0;
  for (int stop = 0; stop < 2; ++stop) {
    const double end = 0.5 * (stop + 1);
    while (simulation.time() < end - 1e-9) {
      const StepReport r =
          simulation.step(std::min(simulation.stable_dt(), end - simulation.time()));
      if (result.steps++ == 0) volume = r.water_volume;
      result.volume_change = r.water_volume / volume - 1.0;
      result.iterations = most_iterations(r, result.iterations);
    }
    result.long_axis[stop] = extent(simulation.grid(), simulation.fluid().phi, Vec3::Zero(), 2);
    result.short_axis[stop] = extent(simulation.grid(), simulation.fluid().phi, Vec3::Zero(), 0);
  }
  return result;
}

}  // namespace archetide
