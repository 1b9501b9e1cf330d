#include "tests/support/coupled_tank.h"

#include <cmath>

#include "tests/support/synthetic_archetype.h"

namespace archetide {

CoupledTank::CoupledTank(const Grid& grid) {
  options.grid = grid;
  options.has_water = true;
  options.hydrostatics.gravity = Vec3::Zero();
  options.solve.tolerance = 1e-12;
  phi.resize(grid.nx, grid.ny, grid.nz, -1e3);
  u.resize(grid, 0.0);
}

CoupledTank::CoupledTank(int n, double half)
    : CoupledTank(Grid{n, n, n, 2.0 * half / n, Vec3::Constant(-half)}) {}

SolveReport CoupledTank::solve(double dt, Stage stage) {
  Coupling coupling(options, obstacles);
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
