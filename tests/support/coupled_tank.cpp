#include "tests/support/coupled_tank.h"

#include <cmath>

#include "tests/support/synthetic_archetype.h"

namespace archetide {

CoupledTank::CoupledTank(int n, double half) {
  Grid& g = options.grid;
  g.nx = g.ny = g.nz = n;
  g.dx = 2.0 * half / n;
  g.origin = Vec3::Constant(-half);
  options.has_water = true;
  options.hydrostatics.gravity = Vec3::Zero();
  options.solve.tolerance = 1e-12;
  phi.resize(n, n, n, -1e3);
  u.resize(g, 0.0);
}

SolveReport CoupledTank::solve(double dt, Stage stage) {
  Coupling coupling(options, {});
  std::vector<StageBody> stage_bodies;
  for (const ReducedBody& b : bodies)
    stage_bodies.push_back({&b, current_configuration(b), {}, false, {}});
  const SolveReport report =
      coupling.couple(stage, dt, {&phi, nullptr, 0.0}, stage_bodies, u, results);
  divergence = coupling.last_divergence();
  return report;
}

TriMesh volume_true_sphere(int subdivisions, double radius) {
  TriMesh mesh = icosphere(subdivisions, radius);
  const double scale = radius * std::cbrt(4.0 / 3.0 * M_PI / enclosed_volume(mesh));
  for (Vec3& v : mesh.vertices) v *= scale;
  return mesh;
}

}  // namespace archetide
