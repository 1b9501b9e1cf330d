// Drafts of the floating bodies of a scene of spheres against the closed form, in the mean over the
// last third of the run.
//   bench_drafts SCENE ARCHETYPES_DIR [key=value ...]
#include <cmath>
#include <cstdio>

#include "runtime/scene/expectations.h"
#include "runtime/scene/parse_scene.h"
#include "runtime/scene/run_loop.h"
#include "runtime/scene/scene_builder.h"
#include "tests/support/float_draft.h"

namespace archetide {
namespace {

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

  // Time means over the last third; the level follows from the volumes of water and of submerged
  // bodies.
  std::vector<double> height(n, 0.0), last_speed(n, 0.0), start(n);
  for (std::size_t b = 0; b < n; ++b) start[b] = simulation.bodies()[b].position[2];
  double level = 0.0, weight = 0.0, worst_drift = 0.0, first_volume = 0.0;
  int steps = 0, iterations = 0;
  RunEvents events;
  events.on_step = [&](const StepReport& r) {
    if (steps++ == 0) first_volume = r.water_volume;
    iterations = std::max({iterations, r.position.iterations, r.velocity.iterations});
    worst_drift = std::max(worst_drift, std::abs(r.water_volume / first_volume - 1.0));
    if (r.t < 2.0 / 3.0 * scene.end_time) return;
    for (std::size_t b = 0; b < n; ++b) {
      const ReducedBody& body = simulation.bodies()[b];
      height[b] += r.dt * body.position[2];
      last_speed[b] = body.P.norm() / body_mass(body);
    }
    level += r.dt * calm_level(o, r.water_volume, simulation.bodies());
    weight += r.dt;
  };
  events.on_frame = [] {};
  events.stop_requested = [] { return false; };
  run_frames(simulation, {scene.end_time, scene.fps, {}, {}}, events);

  level /= weight;
  std::printf(
      "grid %d x %d x %d, %d steps, at most %d iterations, volume drift %.3f %%, level %.4f m\n",
      o.grid.nx, o.grid.ny, o.grid.nz, steps, iterations, 100.0 * worst_drift, level);
  std::printf("body   ratio   height m   draft/a    exact   error %% of a   last speed m/s\n");
  for (std::size_t b = 0; b < n; ++b) {
    const ReducedBody& body = simulation.bodies()[b];
    const double a = std::cbrt(body.archetype->volume / (4.0 / 3.0 * M_PI));
    const double ratio = body_mass(body) / body.archetype->volume / o.water_density;
    const double z = height[b] / weight, draft = (level - (z - a)) / a;
    if (ratio < 0.999)
      std::printf("%4zu %7.3f %10.4f %9.4f %8.4f %+12.2f %14.2e\n", b, ratio, z, draft,
                  exact_draft(ratio), 100.0 * (draft - exact_draft(ratio)), last_speed[b]);
    else
      std::printf("%4zu %7.3f %10.4f      moved %+.4f a, above the floor %.4f a %10.2e\n", b, ratio,
                  z, (z - start[b]) / a, (z - o.grid.low()[2]) / a - 1.0, last_speed[b]);
  }
  return kExitDone;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  try {
    return archetide::main_of(argc, argv);
  } catch (const archetide::Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return e.exit_code;
  }
}
