// Cost of a step of one body (both stages, no water), of the test that no element turns inside out
// (far from the limit, and where every tet is looked at) and the bytes of an instance, for
// archetypes of different meshes; of archetypes that keep their matrices also what a body of nodes
// takes: its factor, solves with 1 and 50 right-hand sides, a step.
//   bench_body_step MODES ARCHETYPE.h5 ...
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "common/base/input_error.h"
#include "runtime/numerics/solve_report.h"
#include "runtime/solid/inversion_limit.h"
#include "runtime/solid/nodal_space.h"
#include "tests/support/bench_main.h"
#include "tests/support/best_time.h"
#include "tests/support/dry_body.h"

namespace archetide {
namespace {

// The state does not matter, nor may the mesh.
double microseconds_per_step(ReducedBody body) {
  return best_microseconds(500, [&](int steps) { dry_steps(body, steps, 1e-3, {}); });
}

double microseconds_per_test(const InversionLimit& limit, const VecX& q) {
  double sum = 0.0;
  const double each = best_microseconds(limit.surely_holds(q) ? 10000 : 5, [&](int times) {
    for (int n = 0; n < times; ++n) sum += limit.allowed_share(q);
  });
  return std::isfinite(sum) ? each : NAN;
}

// Just where the bound of the modes says nothing any more.
VecX first_unsure(const InversionLimit& limit, int r) {
  VecX q = VecX::Constant(r, 1e-6);
  while (r > 0 && limit.surely_holds(q)) q *= 1.1;
  return q;
}

void print_nodes(const std::shared_ptr<const Archetype>& archetype) {
  if (archetype->matrices.empty()) return;
  const Stopwatch analysis;
  const auto nodes = std::make_shared<const NodalSpace>(archetype);
  const double analysed = analysis.wall();
  const Stopwatch factoring;
  const auto factor = nodes->factor(1e-4);
  const double factored = factoring.wall();
  const auto milliseconds = [&](int columns) {
    MatX x = MatX::Ones(nodes->size(), columns);
    return 1e-3 * best_microseconds(3, [&](int times) {
             for (int n = 0; n < times; ++n) factor->solve(x);
           });
  };
  ReducedBody body = make_body(archetype, 0);
  free_nodes(nodes, body);
  body.L = archetype->integrals.Sxx.trace() * Vec3(0.1, 0.2, 0.3);
  const double step =
      1e-3 * best_microseconds(3, [&](int steps) { dry_steps(body, steps, 0.02, {}); });
  std::printf(
      "  every node: %d dofs, analysis %.2f s, factor %.2f s, %.0f MB; solve %.1f ms, of 50 %.1f "
      "ms "
      "each; step %.1f ms; %zu bytes/instance\n",
      nodes->size(), analysed, factored, 1e-6 * static_cast<double>(nodes->factor_bytes()),
      milliseconds(1), milliseconds(50) / 50, step, instance_bytes(body));
}

int main_of(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bench_body_step MODES ARCHETYPE.h5 ...\n");
    return kExitInput;
  }
  const int r = std::atoi(argv[1]);
  std::printf(
      "archetype                         tets   surface   modes   us/step   limit far   near, us   "
      "bytes/instance\n");
  for (int n = 2; n < argc; ++n) {
    const auto archetype = std::make_shared<const Archetype>(read_archetype(argv[n]));
    ReducedBody body = make_body(archetype, std::min(r, archetype->r()));
    body.L = archetype->integrals.Sxx.trace() * Vec3(0.1, 0.2, 0.3);
    body.q_dot.setConstant(0.01);
    const InversionLimit limit(*archetype);
    std::printf("%-30s %7zu %9zu %7d %9.3f %11.3f %10.1f %16zu\n", argv[n],
                archetype->tets.tets.size(), archetype->surface.vertices.size(), body.r,
                microseconds_per_step(body), microseconds_per_test(limit, VecX::Zero(body.r)),
                microseconds_per_test(limit, first_unsure(limit, body.r)), instance_bytes(body));
    print_nodes(archetype);
  }
  return kExitDone;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) { return archetide::bench_main(argc, argv, archetide::main_of); }
