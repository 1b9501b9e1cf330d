// Energy of the water that a step reports.
#include "tests/hard/hard_case.h"
#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

TEST(WaterEnergy, StillWaterAtAnyLevelHasItsPotentialEnergy) {
  SimulationOptions o = unit_tank(8);
  for (const double level : {0.4, 0.4375, 0.45, 0.5, 0.55}) {
    Simulation s(o, water_to(o.grid, level), {}, {});
    const double exact = 0.5 * o.water_density * 9.81 * level * level;
    EXPECT_NEAR(s.step(0.01).potential, exact, 1e-12 * exact) << level;
  }
}

// Under water the energy of water and ball together is that of the tank less (rho - rho_b) V g z,
// wherever the ball lies between the cells.
TEST(WaterEnergy, SubmergedBallTakesItsShareAtItsCentre) {
  SimulationOptions o = unit_tank(16);
  const double radius = 0.2, volume = 4.0 / 3.0 * M_PI * std::pow(radius, 3), level = 0.9;
  double worst = 0.0;  // of the energy of the displaced water over a cell
  for (const double z : {0.4, 0.41, 0.4213, 0.4333, 0.45}) {
    ReducedBody ball = rigid_ball(radius, o.water_density, Vec3(0.47, 0.513, z));
    Simulation s(o, water_to(o.grid, level), {ball}, {});
    const double exact = 0.5 * o.water_density * 9.81 * level * level;
    const double unit = o.water_density * volume * 9.81 * o.grid.dx;
    worst = std::max(worst, std::abs(s.step(1e-4).potential - exact) / unit);
  }
  // Measured 6.2e-4: cut cells count as half spaces.
  EXPECT_LT(worst, 0.002);
}

}  // namespace
}  // namespace archetide
