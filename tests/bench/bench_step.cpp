// Cost of a step of water alone, with the air above it and with twice as much: CPU seconds of all
// threads and wall seconds in the coupled solves and outside of them, and memory.
//   bench_step [nx ny nz [particles a cell [steps]]]     default 128 128 128 0 6; 0.4 nz of water
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>

#include "common/base/keep_memory.h"
#include "runtime/simulation.h"
#include "tests/support/cpu_seconds.h"
#include "tests/support/fluid_fields.h"

namespace archetide::test {
namespace {

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double virtual_pages = 0.0, pages = 0.0;
  statm >> virtual_pages >> pages;
  return pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// A tank, 1 m long, with sloshing water, `depth` cells of it.
std::unique_ptr<Simulation> sloshing_tank(int nx, int ny, int nz, int depth, int particles) {
  SimulationOptions o;
  o.grid = unit_grid(nx, ny, nz, 1.0 / nx);
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.particles_per_cell = particles;
  o.tolerance = 1e-6;
  FluidState water;
  const double level = depth * o.grid.dx;
  water.phi = sample_cells(
      o.grid, [&](const Vec3& x) { return x[2] - level * (1.0 + 0.125 * std::cos(M_PI * x[0])); });
  return std::make_unique<Simulation>(o, std::move(water), std::vector<ReducedBody>(),
                                      std::vector<TriMesh>());
}

constexpr int kWarm = 2;  // steps before anything is measured

// Memory of a process that has such a tank and has made kWarm steps: of its own, because a second
// tank lives partly on what the first one's scratch left.
double process_bytes(int nx, int ny, int nz, int depth, int particles) {
  int ends[2];
  if (pipe(ends) != 0) return std::nan("");
  const pid_t child = fork();
  if (child == 0) {
    const double before = resident_bytes();
    const auto tank = sloshing_tank(nx, ny, nz, depth, particles);
    for (int n = 0; n < kWarm; ++n) tank->step(tank->stable_dt());
    const double bytes = resident_bytes() - before;
    _exit(write(ends[1], &bytes, sizeof bytes) == sizeof bytes ? 0 : 1);
  }
  double bytes = std::nan("");
  if (child < 0 || read(ends[0], &bytes, sizeof bytes) != sizeof bytes) bytes = std::nan("");
  waitpid(child, nullptr, 0);
  close(ends[0]), close(ends[1]);
  return bytes;
}

struct Cost {
  double solve = 0.0, rest = 0.0;  // CPU seconds of all threads
  double wall = 0.0;               // seconds outside the solves
  double bytes = 0.0;
  double cells = 0.0;  // of water
};

void add_step(Simulation& simulation, Cost& cost) {
  const double start = cpu_seconds(), start_wall = omp_get_wtime();
  const StepReport r = simulation.step(simulation.stable_dt());
  const double all = cpu_seconds() - start, all_wall = omp_get_wtime() - start_wall;
  double solve = 0.0, solve_wall = 0.0;
  for (const SolveReport* s : {&r.position, &r.velocity}) {
    solve += s->setup_cpu_seconds + s->solve_cpu_seconds;
    solve_wall += s->setup_seconds + s->solve_seconds;
  }
  cost.solve += solve, cost.rest += all - solve, cost.wall += all_wall - solve_wall;
}

int main_of(int nx, int ny, int nz, int particles, int steps) {
  const int water = static_cast<int>(0.4 * nz), heights[2] = {nz, 2 * nz - water};
  std::unique_ptr<Simulation> tank[2];
  Cost cost[2];
  for (int t = 0; t < 2; ++t)  // before any threads: forked processes have only this one
    cost[t].bytes = process_bytes(nx, ny, heights[t], water, particles);
  for (int t = 0; t < 2; ++t) {
    tank[t] = sloshing_tank(nx, ny, heights[t], water, particles);
    for (int n = 0; n < kWarm; ++n) tank[t]->step(tank[t]->stable_dt());
    cost[t].cells = static_cast<double>(water) * nx * ny;
  }
  for (int n = 0; n < steps; ++n)  // in turn: a busy machine is as busy for both
    for (int t = 0; t < 2; ++t) add_step(*tank[t], cost[t]);

  std::printf("%d x %d, water %d cells deep, %d particles a cell, %d threads, %d steps\n", nx, ny,
              water, particles, omp_get_max_threads(), steps);
  std::printf(
      "height   solve s   rest s  rest us / water cell  memory MiB   (a step, CPU seconds)  wall "
      "us "
      "/ water cell\n");
  for (int t = 0; t < 2; ++t)
    std::printf("%6d %9.3f %8.3f %21.3f %11.0f %40.3f\n", heights[t], cost[t].solve / steps,
                cost[t].rest / steps, 1e6 * cost[t].rest / steps / cost[t].cells,
                cost[t].bytes / 1048576.0, 1e6 * cost[t].wall / steps / cost[t].cells);
  std::printf("phases of the first, wall s a step:");
  for (const std::string& phase : tank[0]->profile().phases())
    std::printf(" %s %.3f", phase.c_str(), tank[0]->profile().seconds(phase) / (kWarm + steps));
  std::printf("\n");
  std::printf("twice the air: a step %+.1f %% (outside the solve %+.1f %%), memory %+.1f %%\n",
              100.0 * ((cost[1].solve + cost[1].rest) / (cost[0].solve + cost[0].rest) - 1.0),
              100.0 * (cost[1].rest / cost[0].rest - 1.0),
              100.0 * (cost[1].bytes / cost[0].bytes - 1.0));
  return 0;
}

}  // namespace
}  // namespace archetide::test

int main(int argc, char** argv) {
  archetide::keep_freed_memory();
  int n[5] = {128, 128, 128, 0, 6};
  for (int a = 1; a < argc && a <= 5; ++a) n[a - 1] = std::atoi(argv[a]);
  if (argc > 6 || n[0] < 8 || n[1] < 1 || n[2] < 8 || n[3] < 0 || n[4] < 1) {
    std::fprintf(stderr, "usage: bench_step [nx ny nz [particles a cell [steps]]]\n");
    return 2;
  }
  return archetide::test::main_of(n[0], n[1], n[2], n[3], n[4]);
}
