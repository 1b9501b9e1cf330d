// Energy of the water that a step reports.
#include "tests/hard/hard_case.h"
#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

constexpr double kWorst = 1e-12;  // measured 3.8e-13

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
  expect_at_most("error, of the displaced water over a cell", worst, kWorst);
}

// The same of a plate thinner than a cell in a tank without air, turned and anywhere between the
// cells: what is cut off of a cell counts where it is.
TEST(WaterEnergy, ThinPlateInAFullTankTakesItsShareAtItsCentre) {
  SimulationOptions o = unit_tank(16);
  o.open_side[kZMax] = false;
  const Vec3 lengths(0.42, 0.31, 0.03);
  const double volume = lengths.prod(), unit = o.water_density * volume * 9.81 * o.grid.dx;
  double worst = 0.0;
  for (int n = 0; n < 6; ++n) {
    ReducedBody plate =
        make_body(rigid_surface_archetype(box_surface(lengths, 2), o.water_density), 0);
    plate.position = Vec3(0.5 + 0.011 * n, 0.5 - 0.007 * n, 0.45 + 0.013 * n);
    plate.rotation = Quat(1.0, 0.13 * n, 0.31, -0.05 * n).normalized();
    Simulation s(o, water_to(o.grid, 1.0), {plate}, {});
    const double exact = 0.5 * o.water_density * 9.81;
    worst = std::max(worst, std::abs(s.step(1e-4).potential - exact) / unit);
  }
  expect_at_most("error, of the displaced water over a cell", worst, kWorst);
}

}  // namespace
}  // namespace archetide
