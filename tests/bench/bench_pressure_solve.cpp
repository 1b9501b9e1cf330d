// Time, iterations and true residual of the pressure solve of water in a tank, printed side by
// side.
//   bench_pressure_solve [cells per side ...]

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "runtime/numerics/components.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/pcg.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

constexpr int kRuns = 3;  // the best of these is printed, after one to warm up

// Wall seconds, or with BENCH_CPU set the seconds that all threads of this process used (a busy
// machine).
double now() {
  if (std::getenv("BENCH_CPU")) return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void run(const char* name, const Tank& tank) {
  const PoissonMatrix matrix = make_matrix(tank);
  const std::vector<double> b = random_vector(matrix, 1);
  PoissonOperator op;
  ClosedComponents closed;
  Multigrid multigrid;
  PcgWorkspace workspace;
  PcgOptions options;
  options.tolerance = 1e-6;

  double analyse = 1e9, components = 1e9, setup = 1e9, solve = 1e9, cycle = 1e9, product = 1e9;
  SolveReport report;
  for (int n = 0; n <= kRuns; ++n) {
    std::vector<double> x(b.size(), 0.0), y(b.size(), 0.0);
    double start = now();
    const auto lap = [&] {
      const double t = now() - start;
      start = now();
      return n == 0 ? 1e9 : t;
    };
    op.setup(matrix);
    analyse = std::min(analyse, lap());
    closed.setup(matrix);
    components = std::min(components, lap());
    multigrid.setup(op, &closed);
    setup = std::min(setup, lap());
    report = pcg(ProjectedOperator(op, closed), multigrid, b.data(), x.data(), options, workspace);
    solve = std::min(solve, lap());
    multigrid.apply(b.data(), y.data());
    cycle = std::min(cycle, lap());
    op.apply(b.data(), y.data());
    product = std::min(product, lap());
  }
  std::printf("%-28s %9zu %3d %8.1e %7.1f %7.1f %7.1f %8.1f %8.1f %8.2f %7.1f\n", name,
              op.unknowns(), report.iterations, report.residual, 1e3 * analyse, 1e3 * components,
              1e3 * setup, 1e3 * solve, 1e3 * cycle, 1e3 * product, multigrid.bytes() / 1048576.0);
}

void run_all(int n) {
  const std::string size = std::to_string(n);
  run(("still " + size).c_str(), {n, n, n});
  run(("wavy " + size).c_str(), {n, n, n, 0.4, 0.06 * n});
  run(("closed " + size).c_str(), {n, n, n, 2.0});
  run(("wavy, 12 spheres " + size).c_str(),
      {n, n, n, 0.4, 0.06 * n, random_spheres(12, n, n, n * 2 / 5, 7)});
  run(("closed, 12 spheres " + size).c_str(), {n, n, n, 2.0, 0.0, random_spheres(12, n, n, n, 7)});
}

}  // namespace
}  // namespace archetide::testing

int main(int argc, char** argv) {
  std::printf("%d threads; milliseconds, best of %d\n", omp_get_max_threads(),
              archetide::testing::kRuns);
  std::printf("%-28s %9s %3s %8s %7s %7s %7s %8s %8s %8s %7s\n", "case", "unknowns", "it",
              "residual", "analyse", "closed", "setup", "solve", "V-cycle", "product", "MiB");
  if (argc < 2) archetide::testing::run_all(64);
  for (int a = 1; a < argc; ++a) archetide::testing::run_all(std::atoi(argv[a]));
}
