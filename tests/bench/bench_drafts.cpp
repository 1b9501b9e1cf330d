// Drafts of the floating bodies of a scene of spheres against the closed form, in the mean over the
// last third of the run: below the calm level of the tank, and below the water around the body,
// which is what it floats in while the tank sloshes. Also the largest errors of all runs that would
// have ended in the last third of this one.
//   bench_drafts SCENE ARCHETYPES_DIR [key=value ...]
#include <cmath>
#include <cstdio>

#include "runtime/scene/expectations.h"
#include "runtime/scene/parse_scene.h"
#include "runtime/scene/run_loop.h"
#include "runtime/scene/scene_builder.h"
#include "tests/support/bench_main.h"
#include "tests/support/float_draft.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

struct Sample {
  double t, dt, level;         // s, s, m (calm)
  std::vector<double> height;  // of each body's centre, m
  std::vector<double> around;  // of the surface around floating ones, m
};

bool floats(double ratio) { return ratio < 0.999; }
bool is_neutral(double ratio) { return std::abs(ratio - 1.0) < 1e-3; }

// Mean height of the water on a circle of two radii about the body, m.
double level_around(const Simulation& simulation, const Vec3& centre, double radius) {
  constexpr int kPoints = 16;
  const Grid& g = simulation.grid();
  double sum = 0.0;
  for (int n = 0; n < kPoints; ++n) {
    const double angle = 2.0 * M_PI * n / kPoints;
    sum += water_height(g, simulation.fluid().phi, centre[0] + 2.0 * radius * std::cos(angle),
                        centre[1] + 2.0 * radius * std::sin(angle));
  }
  return g.low()[2] + sum / kPoints;
}

// Mean velocity of the water on a sphere of one and a half radii about the body, m/s: for a flow
// without rotation and the dipole that a body adds to it, the velocity that the water would have at
// the centre without the body.
Vec3 velocity_around(const Simulation& simulation, const Vec3& centre, double radius) {
  constexpr int kPoints = 200;
  const Grid& g = simulation.grid();
  Vec3 sum = Vec3::Zero();
  int wet = 0;
  for (int n = 0; n < kPoints; ++n) {
    const double z = 1.0 - (2.0 * n + 1.0) / kPoints, angle = n * M_PI * (3.0 - std::sqrt(5.0));
    const double across = std::sqrt(1.0 - z * z);
    const Vec3 x =
        centre + 1.5 * radius * Vec3(across * std::cos(angle), across * std::sin(angle), z);
    if (interpolate(g, simulation.fluid().phi, x) >= 0.0) continue;
    sum += interpolate(g, simulation.fluid().u, x);
    ++wet;
  }
  return wet > 0 ? Vec3(sum / wet) : sum;
}

// Means over the last third of what happened until `end`, s.
Sample mean_until(const std::vector<Sample>& samples, double end) {
  const std::size_t n = samples.front().height.size();
  Sample mean{end, 0.0, 0.0, std::vector<double>(n, 0.0), std::vector<double>(n, 0.0)};
  for (const Sample& s : samples) {
    if (s.t < 2.0 / 3.0 * end || s.t > end) continue;
    mean.dt += s.dt, mean.level += s.dt * s.level;
    for (std::size_t b = 0; b < n; ++b) {
      mean.height[b] += s.dt * s.height[b];
      mean.around[b] += s.dt * s.around[b];
    }
  }
  mean.level /= mean.dt;
  for (std::size_t b = 0; b < n; ++b) mean.height[b] /= mean.dt, mean.around[b] /= mean.dt;
  return mean;
}

int main_of(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bench_drafts SCENE ARCHETYPES_DIR [key=value ...]\n");
    return kExitInput;
  }
  const SceneSpec scene = parse_scene(argv[1], {argv + 3, argv + argc});
  ArchetypeLibrary library(".", argv[2]);
  Simulation simulation = make_simulation(build_scene(scene, library), scene);
  const SimulationOptions& o = simulation.options();
  const std::size_t n = simulation.bodies().size();

  std::vector<Vec3> start(n);
  std::vector<double> radius(n), ratio(n);
  for (std::size_t b = 0; b < n; ++b) {
    const ReducedBody& body = simulation.bodies()[b];
    start[b] = body.position;
    radius[b] = std::cbrt(body.archetype->volume / (4.0 / 3.0 * M_PI));
    ratio[b] = body_mass(body) / body.archetype->volume / o.water_density;
  }
  std::vector<Sample> samples;
  std::vector<Vec3> carried(n, Vec3::Zero());  // way of the water around neutral ones, m
  double worst_drift = 0.0, first_volume = 0.0;
  int iterations = 0;
  RunEvents events;
  events.on_step = [&](const StepReport& r) {
    if (samples.empty()) first_volume = r.water_volume;
    iterations = std::max({iterations, r.position.iterations, r.velocity.iterations});
    worst_drift = std::max(worst_drift, std::abs(r.water_volume / first_volume - 1.0));
    Sample s{r.t, r.dt, calm_level(o, r.water_volume, simulation.bodies()), {}, {}};
    for (std::size_t b = 0; b < n; ++b) {
      const Vec3& centre = simulation.bodies()[b].position;
      s.height.push_back(centre[2]);
      s.around.push_back(floats(ratio[b]) ? level_around(simulation, centre, radius[b]) : 0.0);
      if (is_neutral(ratio[b])) carried[b] += r.dt * velocity_around(simulation, centre, radius[b]);
    }
    samples.push_back(std::move(s));
  };
  events.on_frame = [] {};
  events.stop_requested = [] { return false; };
  run_frames(simulation, {scene.end_time, scene.fps, {}, {}}, events);

  // Errors of the draft below `level`, percent of the radius.
  const auto error = [&](const Sample& mean, std::size_t b, double level) {
    return 100.0 * ((level - mean.height[b]) / radius[b] + 1.0 - exact_draft(ratio[b]));
  };
  const Sample mean = mean_until(samples, scene.end_time);
  std::vector<double> worst(n, 0.0), worst_around(n, 0.0);
  for (const Sample& s : samples) {
    if (s.t < 2.0 / 3.0 * scene.end_time) continue;
    const Sample until = mean_until(samples, s.t);
    for (std::size_t b = 0; b < n; ++b) {
      worst[b] = std::max(worst[b], std::abs(error(until, b, until.level)));
      worst_around[b] = std::max(worst_around[b], std::abs(error(until, b, until.around[b])));
    }
  }
  std::printf(
      "grid %d x %d x %d, %zu steps, at most %d iterations, volume drift %.3f %%, level %.4f m\n",
      o.grid.nx, o.grid.ny, o.grid.nz, samples.size(), iterations, 100.0 * worst_drift, mean.level);
  std::printf(
      "draft in the mean of t = %.2f to %.2f s; error in %% of the radius a below the water "
      "around the body and below the calm level; worst of ends from %.2f s on\n",
      2.0 / 3.0 * scene.end_time, scene.end_time, 2.0 / 3.0 * scene.end_time);
  std::printf("body   ratio   height m  exact/a   around   (worst)     calm   (worst)  last m/s\n");
  for (std::size_t b = 0; b < n; ++b) {
    const ReducedBody& body = simulation.bodies()[b];
    const double z = mean.height[b], last_speed = body.P.norm() / body_mass(body);
    if (floats(ratio[b]))
      std::printf("%4zu %7.3f %10.4f %8.4f %+8.2f %9.2f %+8.2f %9.2f %9.2e\n", b, ratio[b], z,
                  exact_draft(ratio[b]), error(mean, b, mean.around[b]), worst_around[b],
                  error(mean, b, mean.level), worst[b], last_speed);
    else
      std::printf("%4zu %7.3f %10.4f moved %+.4f a, above the floor %.4f a %22.2e\n", b, ratio[b],
                  z, (z - start[b][2]) / radius[b], (z - o.grid.low()[2]) / radius[b] - 1.0,
                  last_speed);
    if (is_neutral(ratio[b])) {
      const Vec3 way = (body.position - start[b]) / radius[b], water = carried[b] / radius[b];
      std::printf(
          "     way of its centre (%+.3f %+.3f %+.3f) a, of the water around it (%+.3f %+.3f "
          "%+.3f) a\n",
          way[0], way[1], way[2], water[0], water[1], water[2]);
    }
  }
  return kExitDone;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) { return archetide::bench_main(argc, argv, archetide::main_of); }
