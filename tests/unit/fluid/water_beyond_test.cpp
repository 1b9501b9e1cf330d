#include "runtime/fluid/water_beyond.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace archetide {
namespace {

const VelocityBeyond kStill = [] {
  VelocityBeyond still;
  still.fill(Vec3::Zero());
  return still;
}();

// Through the low x side water comes in by `come` cells; through the high one it leaves.
struct Stream {
  Grid g{6, 3, 3, 0.25, Vec3::Zero()};
  MacField carrier, u;

  explicit Stream(double come) : carrier(g, 0.0), u(g, 2.0) { carrier[0].fill(come * g.dx); }
};

// Of the point L cells from the side the share 1 - (c - L) is the tank's; other sides change nothing.
TEST(WaterBeyond, ComesInByThePathsShare) {
  for (const double come : {0.0, 0.3, 1.0, 1.4}) {
    Stream s(come);
    Sides sides{};
    sides[kXMin] = sides[kXMax] = true;
    bring_in_water(s.g, sides, kStill, s.carrier, 1.0, s.u);
    for (int component = 0; component < 3; ++component)
      for (int layer = 0; layer < s.u[component].nx(); ++layer)
        EXPECT_NEAR(s.u[component](layer, 1, 1), 2.0 * std::clamp(1.0 - (come - layer), 0.0, 1.0),
                    1e-14)
            << come << " cells, component " << component << ", layer " << layer;
  }
}

TEST(WaterBeyond, ASideWithAirBringsNothing) {
  Stream s(0.7);
  Sides sides{};
  sides[kXMax] = sides[kYMin] = true;
  bring_in_water(s.g, sides, kStill, s.carrier, 1.0, s.u);
  EXPECT_EQ(s.u[0](0, 1, 1), 2.0);
  EXPECT_EQ(s.u[1](0, 0, 1), 2.0);
}

// A stream that goes through the tank goes on.
TEST(WaterBeyond, AStreamStaysAsItIs) {
  Stream s(0.8);
  s.u[0].fill(0.8 * s.g.dx);
  Sides sides;
  sides.fill(true);
  const VelocityBeyond beyond = mean_at_sides(s.g, s.u);
  EXPECT_NEAR((beyond[kXMin] - Vec3(0.8 * s.g.dx, 2.0, 2.0)).norm(), 0.0, 1e-14);
  const MacField before = s.u;
  bring_in_water(s.g, sides, beyond, s.carrier, 1.0, s.u);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < s.u[a].size(); ++n) EXPECT_NEAR(s.u[a][n], before[a][n], 1e-14);
}

}  // namespace
}  // namespace archetide
