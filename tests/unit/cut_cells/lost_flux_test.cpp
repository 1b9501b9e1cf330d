#include "runtime/cut_cells/lost_flux.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "runtime/pressure/pressure_system.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

/// A rigid ball in a closed tank of 12^3 cells of 1 m about the origin, full of water but for air
/// above `level`.
struct BallInTank {
  PressureSystem system;
  BodyFlux flux;
  ClosedComponents closed;
  FaceField<double> open;

  BallInTank(const Vec3& centre, double level) {
    CoupledTank tank(12, 6.0);
    const Grid& g = tank.options.grid;
    ReducedBody ball = make_body(rigid_surface_archetype(volume_true_sphere(4, 3.3), 1000.0), 0);
    ball.position = centre;
    SolidFractions solids;
    solids.face.resize(g, 0.0);
    solids.cell.resize(g.nx, g.ny, g.nz, 0.0);
    DualFaces faces;
    flux = cut_body(g, body_surface(ball, ModalMass::kExact), solids, faces);
    open.resize(g, 1.0);
    for (int a = 0; a < 3; ++a)
      for (std::size_t f = 0; f < open[a].size(); ++f)
        open[a][f] = std::max(open[a][f] - solids.face[a][f], 0.0);
    close_sides(g, {}, open);
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i < g.nx; ++i)
          tank.phi(i, j, k) = std::max(g.cell_centre(i, j, k)[2] - level, -3.0);
    assemble_pressure_system(g, {&tank.phi}, open, {}, {}, {&faces}, system);
    closed.setup(system.matrix);
  }
  /// Net flux of the motions into the unknowns, of their gross flux.
  double net() const {
    VecX sum = VecX::Zero(6);
    double gross = 0.0;
    for (std::size_t m = 0; m < flux.cell.size(); ++m) {
      if (!holds_unknown(system.matrix, flux.cell[m])) continue;
      sum += flux.flux.col(static_cast<Eigen::Index>(m));
      gross += flux.flux.col(static_cast<Eigen::Index>(m)).norm();
    }
    return sum.norm() / gross;
  }
};

// A tenth of a cell in the floor: part of the surface is beyond the tank, or in cells that it closes.
TEST(LostFlux, OfABallInTheFloorGoesToItsNearestCells) {
  BallInTank ball(Vec3(0.31, -0.17, -6.0 + 3.2), INFINITY);
  EXPECT_GT(ball.net(), 1e-3);
  settle_lost_flux(ball.system.matrix, ball.closed, ball.flux);
  EXPECT_LT(ball.net(), 1e-14);
  for (const std::int64_t cell : ball.flux.cell)
    EXPECT_TRUE(holds_unknown(ball.system.matrix, cell));
}

// Where air takes the volume nothing is moved, and nothing is left of what is beyond the tank.
TEST(LostFlux, IsLeftOutWhereAirGivesWay) {
  BallInTank ball(Vec3(0.31, -0.17, -6.0 + 3.2), 3.0);
  const double before = ball.net();
  settle_lost_flux(ball.system.matrix, ball.closed, ball.flux);
  EXPECT_EQ(ball.net(), before);
  for (const std::int64_t cell : ball.flux.cell) EXPECT_GE(cell, 0);
}

// Nothing is lost of a ball that touches nothing.
TEST(LostFlux, LeavesAFreeBallAlone) {
  BallInTank ball(Vec3(0.31, -0.17, 0.4), INFINITY);
  EXPECT_LT(ball.net(), 1e-14);
  const BodyFlux before = ball.flux;
  settle_lost_flux(ball.system.matrix, ball.closed, ball.flux);
  for (std::size_t m = 0; m < ball.flux.cell.size(); ++m) {
    const auto at = std::ranges::find(before.cell, ball.flux.cell[m]) - before.cell.begin();
    EXPECT_EQ(ball.flux.flux.col(static_cast<Eigen::Index>(m)), before.flux.col(at));
  }
}

}  // namespace
}  // namespace archetide
