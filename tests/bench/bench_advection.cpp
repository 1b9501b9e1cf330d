// Cost of the parts of a step that move water: advection, extrapolation, level set, particles.
//   bench_advection [cells per side ...]

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "runtime/fluid/advection.h"
#include "runtime/fluid/extrapolation.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/particle_level_set.h"
#include "runtime/fluid/redistance.h"
#include "runtime/fluid/surface.h"
#include "tests/support/fluid_fields.h"

namespace archetide::test {
namespace {

constexpr int kRuns = 5;  // the best of these is printed

// Wall seconds, or with BENCH_CPU set the seconds that all threads of this process used (a busy
// machine).
double now() {
  if (std::getenv("BENCH_CPU")) return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

template <class Prepare, class Work>
void time_it(const char* name, double items, const Prepare& prepare, const Work& work) {
  double best = 1e30;
  for (int run = 0; run < kRuns; ++run) {
    prepare();
    const double start = now();
    work();
    best = std::min(best, now() - start);
  }
  std::printf("  %-24s %8.1f ms %8.1f ns per item of %.0f\n", name, 1e3 * best, 1e9 * best / items,
              items);
}

// Half a tank with a wavy surface in a smooth flow of one cell per step.
struct Tank {
  Grid g;
  FluidState state;
  SurfaceOptions options;
  Array3<unsigned char> no_solid;
  FaceField<unsigned char> wet;
  double near_water = 0.0, band = 0.0;

  explicit Tank(int n) : g(unit_grid(n, n, n, 1.0 / n)), wet(g) {
    state.u = sample_faces(g, [](int a, const Vec3& x) {
      return a == 0   ? std::sin(M_PI * x[0]) * std::cos(M_PI * x[2])
             : a == 2 ? -std::cos(M_PI * x[0]) * std::sin(M_PI * x[2])
                      : 0.1 * std::sin(2 * M_PI * x[1]);
    });
    state.phi = sample_cells(g, [](const Vec3& x) {
      return x[2] - 0.5 - 0.05 * std::cos(6 * x[0]) * std::cos(5 * x[1]);
    });
    prepare_surface(g, state, options, no_solid);
    for (std::size_t c = 0; c < state.phi.size(); ++c) {
      near_water += state.phi[c] < 4 * g.dx;
      band += std::abs(state.phi[c]) < 5 * g.dx;
    }
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < wet[a].nz(); ++k)
        for (int j = 0; j < wet[a].ny(); ++j)
          for (int i = 0; i < wet[a].nx(); ++i)
            wet[a](i, j, k) = interpolate(g, state.phi, g.face_centre(a, i, j, k)) < 0.5 * g.dx;
  }
};

void run(int n) {
  Tank tank(n);
  const Grid& g = tank.g;
  FluidState& s = tank.state;
  const double dt = g.dx, band = 5 * g.dx;
  std::printf("%d^3, %d threads, %.0f cells of water or near it, %.0f in the band\n", n,
              omp_get_max_threads(), tank.near_water, tank.band);

  FaceField<unsigned char> valid;
  MacField result(g);
  const auto nothing = [] {};
  time_it(
      "extrapolate velocity", tank.near_water, [&] { valid = tank.wet; },
      [&] { extrapolate_velocity({&s.u}, valid, 4); });
  time_it("advect velocity", tank.near_water, nothing,
          [&] { advect_velocity(g, s.u, s.u, dt, valid, tank.wet, result); });
  const Array3<double> start = s.phi;
  time_it(
      "advect level set", tank.band, [&] { s.phi = start; },
      [&] { advect_level_set(g, s.u, dt, s.phi, band); });
  const Array3<double> moved = s.phi;
  time_it(
      "redistance", tank.band, [&] { s.phi = moved; }, [&] { redistance(g, s.phi, band); });
  time_it("water volume", tank.band, nothing, [&] { water_volume(g, s.phi); });
  s.phi = start;
  time_it("surface, no particles", tank.near_water, nothing,
          [&] { advance_surface(g, s, dt, tank.options, tank.no_solid, 1); });

  tank.options.particles_per_cell = 16;
  reseed_particles(g, s.phi, tank.no_solid, 16, 0, s.particles);
  const double count = static_cast<double>(s.particles.size());
  time_it("advect particles", count, nothing,
          [&] { advect_particles(g, s.u, 0.2 * dt, s.particles); });
  time_it("correct", count, nothing,
          [&] { correct_level_set(g, s.particles, tank.no_solid, s.phi); });
  time_it("adjust radii", count, nothing, [&] { adjust_radii(g, s.phi, s.phi, s.particles); });
  time_it("reseed", count, nothing,
          [&] { reseed_particles(g, s.phi, tank.no_solid, 16, 1, s.particles); });
}

}  // namespace
}  // namespace archetide::test

int main(int argc, char** argv) {
  std::vector<int> sizes;
  for (int i = 1; i < argc; ++i) sizes.push_back(std::atoi(argv[i]));
  if (sizes.empty()) sizes = {64, 128};
  for (int n : sizes) archetide::test::run(n);
}
