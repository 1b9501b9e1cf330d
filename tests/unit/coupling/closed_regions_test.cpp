// Water that touches no air: what flows into it and cannot go anywhere is reported, the rest is
// solved.
#include <gtest/gtest.h>

#include "runtime/coupling/coupled_solve.h"
#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

// A closed tank of 8 x 4 x 4 cells, full, with a wall in its middle that has a hole or not, and a
// piston of one dof that pushes `flow` m^3/s per m/s into one cell on the left of it.
struct PistonTank {
  Grid g = test::unit_grid(8, 4, 4, 0.125);
  FaceField<double> open{g, 1.0};
  Array3<double> phi{8, 4, 4, -1.0};
  PressureSystem system;
  MacField u{g, 0.0};
  std::vector<CoupledBody> piston{1};

  PistonTank(bool hole, bool free, bool second) {
    close_sides(g, {}, open);
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j) open[0](4, j, k) = hole && j == 1 && k == 1 ? 1.0 : 0.0;
    assemble_pressure_system(g, {&phi}, open, {}, {}, {}, system);
    CoupledBody& p = piston[0];
    const auto cell = [&](int i) { return static_cast<std::int64_t>(phi.index(i, 2, 2)); };
    p.flux.cell = {cell(1)};
    p.flux.flux = MatX::Zero(6, 1);
    p.flux.flux(0, 0) = kArea;
    if (second) {  // what it pushes in here it takes out on the right
      p.flux.cell.push_back(cell(6));
      p.flux.flux = MatX::Zero(6, 2);
      p.flux.flux(0, 0) = kArea, p.flux.flux(0, 1) = -kArea;
    }
    p.y_star = VecX::Zero(6);
    p.y_star[0] = kSpeed;
    p.inverse_mass = MatX::Zero(6, 6);
    if (free) p.inverse_mass(0, 0) = 1.0 / 20.0;
  }
  SolveReport solve() {
    CoupledSolver solver;
    FaceField<unsigned char> valid(g, 0);
    Array3<double> pressure(8, 4, 4, 0.0);
    return solver.solve(g, system, 0.01, piston, {1e-12, 200}, u, valid, pressure);
  }
  static constexpr double kArea = 0.01, kSpeed = 0.5;  // m^2, m/s
};

// A piston that nothing stops, into a full tank: all of its flow is incompatible.
TEST(ClosedRegions, FlowThatNothingCanAnswerIsReported) {
  for (const bool hole : {true, false}) {
    PistonTank tank(hole, false, false);
    const SolveReport r = tank.solve();
    EXPECT_TRUE(r.converged);
    EXPECT_EQ(r.closed_regions, hole ? 1 : 2);
    EXPECT_NEAR(r.incompatible_flow, PistonTank::kArea * PistonTank::kSpeed, 1e-14);
    EXPECT_EQ(tank.piston[0].y[0], PistonTank::kSpeed);
  }
}

// One that gives way comes to a stop instead.
TEST(ClosedRegions, ABodyThatGivesWayAnswersForItsFlow) {
  PistonTank tank(true, true, false);
  const SolveReport r = tank.solve();
  EXPECT_TRUE(r.converged);
  EXPECT_LT(r.incompatible_flow, 1e-15);
  EXPECT_LT(std::abs(tank.piston[0].y[0]), 1e-10 * PistonTank::kSpeed);
}

// One that takes out what it pushes in moves water through the hole; without a hole two regions
// each cannot take it.
TEST(ClosedRegions, FlowThroughAHoleIsCompatible) {
  PistonTank with(true, false, true), without(false, false, true);
  const SolveReport through = with.solve(), shut = without.solve();
  EXPECT_TRUE(through.converged && shut.converged);
  EXPECT_LT(through.incompatible_flow, 1e-15);
  const double flow = PistonTank::kArea * PistonTank::kSpeed;
  // what the hole's face carries, m^3/s
  EXPECT_NEAR(with.u[0](4, 1, 1) * 0.125 * 0.125, flow, 1e-10 * flow);
  EXPECT_NEAR(shut.incompatible_flow, flow, 1e-14);
}

}  // namespace
}  // namespace archetide
