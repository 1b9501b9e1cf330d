#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// Five spheres of density ratio 0.2 to 1.3 released under water, open top; iterations to 1e-6 and
// the divergence left.
TEST(CoupledIterations, FiveSpheresTakeFewAndLeaveNoDivergence) {
  for (const int n : {32, 64}) {
    CoupledTank tank(n, 0.5);
    tank.options.hydrostatics.gravity = Vec3(0, 0, -9.81);
    tank.options.open_side[kZMax] = true;
    tank.options.solve.tolerance = 1e-6;
    const Grid& g = tank.options.grid;
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) tank.phi(i, j, k) = g.cell_centre(i, j, k)[2] - 0.311;
    const Vec3 centres[5] = {Vec3(-0.3, -0.3, 0.1), Vec3(0.3, -0.29, 0.05), Vec3(0.01, 0.02, 0.0),
                             Vec3(-0.3, 0.31, -0.1), Vec3(0.29, 0.3, -0.2)};
    const double densities[5] = {200, 400, 600, 1000, 1300};
    for (int b = 0; b < 5; ++b) {
      tank.bodies.push_back(
          make_body(rigid_surface_archetype(volume_true_sphere(3, 0.13), densities[b]), 0));
      tank.bodies.back().position = centres[b];
    }
    const double dt = 0.01;
    const SolveReport report = tank.solve(dt);
    std::printf("%3d^3: %d iterations, residual %.1e, divergence %.1e 1/s\n", n, report.iterations,
                report.residual, tank.divergence);
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.iterations, 20);
    // The residual is relative to the right-hand side, whose entries are of the order of g dt per
    // cell; the largest entry is at most the 2-norm, which for n^3 cells is below sqrt(n^3) times
    // that.
    EXPECT_LT(tank.divergence, 1e-6 * 9.81 * dt * std::sqrt(double(n) * n * n) / g.dx);
  }
}

}  // namespace
}  // namespace archetide
