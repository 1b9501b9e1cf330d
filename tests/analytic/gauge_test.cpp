// What gauges read of water whose pressure is known.
#include "runtime/gauge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

constexpr double kGravity = 9.81, kDensity = 1000.0;

// A tank of 1 m with an open top.
SimulationOptions unit_tank(int cells) {
  SimulationOptions o;
  o.grid = {cells, cells, cells, 1.0 / cells, Vec3::Zero()};
  o.has_water = o.open_side[kZMax] = true;
  return o;
}

// Depth times rho g to the tolerance of the solve, at walls and on an obstacle as well; nothing in
// the obstacle, air above.
TEST(Gauge, ReadsTheDepthOfStillWater) {
  SimulationOptions o = unit_tank(16);
  o.tolerance = 1e-10;
  const double level = 0.53;
  Simulation s(o, water_to(o.grid, level), {}, {box_between({0.4, 0.4, -0.1}, {0.63, 0.61, 0.3})});
  for (int n = 0; n < 3; ++n) s.step(0.01);
  for (const Vec3& x : {Vec3(0.21, 0.77, 0.11), Vec3(0, 0, 0), Vec3(1, 0.5, 0.52),
                        Vec3(0.4, 0.5, 0.2), Vec3(0.5, 0.5, 0.3)}) {
    const GaugeReading r = read_gauge(s, 0.01, x);
    ASSERT_TRUE(r.pressure && r.velocity && r.level);
    EXPECT_NEAR(*r.pressure, kDensity * kGravity * (level - x[2]), 1e-6);
    EXPECT_LT(r.velocity->norm(), 1e-9);
    EXPECT_NEAR(*r.level, level, 1e-9);
  }
  const GaugeReading inside = read_gauge(s, 0.01, Vec3(0.52, 0.51, 0.1));
  EXPECT_FALSE(inside.pressure || inside.velocity);
  EXPECT_NEAR(*inside.level, level, 1e-9);
  for (const double z : {0.6, 1.0}) {
    const GaugeReading air = read_gauge(s, 0.01, Vec3(0.2, 0.2, z));
    EXPECT_EQ(*air.pressure, 0.0);
    EXPECT_FALSE(air.velocity);
    EXPECT_NEAR(*air.level, level, 1e-9);
  }
}

TEST(Gauge, ReadsNothingWhereItIsDry) {
  SimulationOptions o = unit_tank(16);
  Simulation s(o,
               water_where(o.grid, [](const Vec3& x) { return std::max(x[0] - 0.4, x[2] - 0.3); }),
               {}, {});
  s.step(0.001);
  const GaugeReading r = read_gauge(s, 0.001, Vec3(0.8, 0.5, 0.1));
  EXPECT_EQ(*r.pressure, 0.0);
  EXPECT_FALSE(r.level || r.velocity);
}

// Column of a x 2 a in the instant after its gate is gone, a = 1 m: pressures in rho g a on wall and
// floor, by the Fourier series of the plane problem. Second order but for the corner of wall and
// surface.
TEST(Gauge, ReadsTheFirstInstantOfADamBreak) {
  const double dt = 1e-5;
  for (const int n : {16, 32}) {
    SimulationOptions o;
    o.grid = {2 * n, 1, 5 * n / 2, 1.0 / n, Vec3::Zero()};
    o.has_water = o.open_side[kZMax] = true;
    o.tolerance = 1e-10;
    Simulation s(
        o, water_where(o.grid, [](const Vec3& x) { return std::max(x[0] - 1.0, x[2] - 2.0); }), {},
        {});
    s.step(dt);
    const struct {
      Vec3 at;
      double exact;
    } points[] = {{{0, 0, 0}, 0.7394319991},
                  {{0, 0, 0.25}, 0.5200543942},
                  {{0, 0, 0.5}, 0.3576092444},
                  {{0.5, 0, 0}, 0.6081254484},
                  {{0, 0, 1}, 0.1601220667}};
    double worst = 0.0;
    for (const auto& point : points) {
      const double p = *read_gauge(s, dt, point.at).pressure / (kDensity * kGravity);
      worst = std::max(worst, std::abs(p / point.exact - 1.0));
    }
    std::printf("measured: %d cells, at most %.2e off\n", n, worst);
    EXPECT_LT(worst, 1.3 / (n * n));  // measured 1.8e-3, 4.4e-4
  }
}

}  // namespace
}  // namespace archetide
