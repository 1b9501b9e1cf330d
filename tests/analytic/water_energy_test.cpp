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

}  // namespace
}  // namespace archetide
