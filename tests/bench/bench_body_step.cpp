// Cost of a step of one body (both stages, no water) and the bytes of an instance, for archetypes
// of different meshes.
//   bench_body_step MODES ARCHETYPE.h5 ...
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "common/input_error.h"
#include "tests/support/dry_body.h"

namespace archetide {
namespace {

// Best of several batches, microseconds per step: the state does not matter, nor may the mesh.
double microseconds_per_step(ReducedBody body, const ModalOptions& options) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 20, kSteps = 500;
  double best = INFINITY;
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto start = Clock::now();
    dry_steps(body, kSteps, 1e-3, options);
    best = std::min(
        best, std::chrono::duration<double, std::micro>(Clock::now() - start).count() / kSteps);
  }
  return best;
}

int main_of(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bench_body_step MODES ARCHETYPE.h5 ...\n");
    return kExitInput;
  }
  const int r = std::atoi(argv[1]);
  std::printf(
      "archetype                         tets   surface   modes   us/step   bytes/instance\n");
  for (int n = 2; n < argc; ++n) {
    const auto archetype = std::make_shared<const Archetype>(read_archetype(argv[n]));
    ReducedBody body = make_body(archetype, std::min(r, archetype->r()));
    body.L = archetype->integrals.Sxx.trace() * Vec3(0.1, 0.2, 0.3);
    body.q_dot.setConstant(0.01);
    std::printf("%-30s %7zu %9zu %7d %9.3f %16zu\n", argv[n], archetype->tets.tets.size(),
                archetype->surface.vertices.size(), body.r, microseconds_per_step(body, {}),
                instance_bytes(body));
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
