#include "runtime/fluid/spray.h"

#include <gtest/gtest.h>

#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

using test::kNoSolid;
using test::sample_cells;
using test::sample_faces;
using test::unit_grid;

Array3<double> water_below(const Grid& g, double level) {
  return sample_cells(g, [&](const Vec3& x) { return x[2] - level; });
}

// Water particles a cell or more over the surface leave, air particles and others stay in their
// order.
TEST(Spray, TakesWaterParticlesThatAreAwayFromTheSurface) {
  const Grid g = unit_grid(8, 8, 8, 0.125);
  const auto phi = water_below(g, 0.5);
  const MacField u = sample_faces(g, [](int a, const Vec3&) { return a + 1.0; });
  Particles p;
  for (const double z : {0.4, 0.6, 0.64, 0.8}) {  // the third is 1.12 cells up
    p.position.emplace_back(0.4, 0.5, z), p.radius.push_back(0.02f), p.sign.push_back(-1);
    p.position.emplace_back(0.6, 0.5, z), p.radius.push_back(0.03f), p.sign.push_back(1);
  }
  Spray spray;
  const double drop = std::pow(0.125, 3) / 4;
  Array3<double> residual(8, 8, 8, 0.0);
  EXPECT_NEAR(release_spray(g, phi, u, kNoSolid, 4, p, residual, spray), 2 * drop, 1e-15);
  EXPECT_EQ(residual(3, 4, 5), -0.25);  // both cells give theirs
  EXPECT_EQ(residual(3, 4, 6), -0.25);
  ASSERT_EQ(spray.size(), 2u);
  EXPECT_EQ(spray.position[0], Vec3(0.4, 0.5, 0.64));
  EXPECT_EQ(spray.position[1], Vec3(0.4, 0.5, 0.8));
  EXPECT_LT((spray.velocity[1] - Vec3(1, 2, 3)).norm(), 1e-14);
  EXPECT_NEAR(spray_volume(spray), 2 * drop, 1e-15);
  ASSERT_EQ(p.size(), 6u);
  EXPECT_EQ(p.position[5], Vec3(0.6, 0.5, 0.8));
  EXPECT_EQ(p.radius[5], 0.03f);

  Array3<unsigned char> solid(8, 8, 8, 1);
  p.position.emplace_back(0.4, 0.5, 0.8), p.radius.push_back(0.02f), p.sign.push_back(-1);
  EXPECT_EQ(release_spray(g, phi, u, solid, 4, p, residual, spray), 0.0);
}

// x + v t - g t^2 / 2 exactly, until it is under water again; what goes up comes down.
TEST(Spray, FliesOnParabolasAndGivesItsWaterBack) {
  const Grid tank = unit_grid(8, 8, 64, 0.125);
  const auto phi = water_below(unit_grid(8, 8, 8, 0.125), 0.5);  // fields end at 1 m of 8
  const Vec3 gravity(0, 0, -10), x(0.3, 0.5, 0.7), v(0.02, 0.01, 8.0);
  Spray spray{{x}, {v}, {0.25}};
  const double dt = 0.01;
  // back at the surface when 0.2 + 8 t - 5 t^2 = 0
  const double back = (8.0 + std::sqrt(64.0 + 4.0)) / 10.0;
  double t = 0.0, landed = 0.0;
  const Array3<double> open(8, 8, 8, 0.0);
  Array3<double> residual(8, 8, 8, 0.0);
  while (spray.size() > 0 && t < 10.0) {
    t += dt;
    const SprayEnds ends = fly_spray(tank, {}, gravity, dt, phi, open, residual, spray);
    landed += ends.landed;
    EXPECT_EQ(ends.left, 0.0);
    if (spray.size() > 0) {
      EXPECT_LT((spray.position[0] - (x + t * v + 0.5 * t * t * gravity)).norm(), 1e-12);
    }
  }
  EXPECT_NEAR(t, back, dt);
  EXPECT_EQ(landed, 0.25);
  EXPECT_NEAR(sum_by_plane(residual), 0.25 / std::pow(0.125, 3), 1e-12);
}

TEST(Spray, MeetsTheSidesOfTheTankAndSolids) {
  const Grid g = unit_grid(8, 8, 8, 0.125);
  const auto phi = water_below(g, 0.1);
  const Vec3 x(0.9, 0.5, 0.6), v(3, 0, 0);
  Spray spray{{x}, {v}, {0.5}};
  Array3<double> solid(8, 8, 8, 0.0), residual(8, 8, 8, 0.0);
  fly_spray(g, {}, Vec3::Zero(), 0.1, phi, solid, residual, spray);
  ASSERT_EQ(spray.size(), 1u);  // at the closed wall
  EXPECT_EQ(spray.position[0], Vec3(1.0, 0.5, 0.6));
  EXPECT_EQ(spray.velocity[0], Vec3(0, 0, 0));

  spray = {{x}, {v}, {0.5}};
  Sides open{};
  open[kXMax] = true;
  EXPECT_EQ(fly_spray(g, open, Vec3::Zero(), 0.1, phi, solid, residual, spray).left, 0.5);
  EXPECT_EQ(spray.size(), 0u);

  // It stops above a body and slides on along it.
  const Vec3 above(0.5, 0.5, 0.64);
  spray = {{above}, {Vec3(0.5, 0, -2)}, {0.5}};
  for (int j = 0; j < 8; ++j)
    for (int i = 0; i < 8; ++i) solid(i, j, 4) = 1.0;  // z from 0.5 to 0.625
  EXPECT_EQ(fly_spray(g, {}, Vec3::Zero(), 0.01, phi, solid, residual, spray).landed, 0.0);
  ASSERT_EQ(spray.size(), 1u);
  EXPECT_EQ(spray.position[0], above);
  EXPECT_NEAR(spray.velocity[0][0], 0.5, 1e-15);
  EXPECT_NEAR(spray.velocity[0][2], 0.0, 1e-15);
}

// A drop joins water at rest: all its momentum is the water's.
TEST(Spray, GivesItsMomentumToTheWater) {
  const Grid g = unit_grid(8, 8, 8, 0.125);
  const Array3<double> held(8, 8, 8, 1.0);
  MacField u(g, 0.0);
  const double volume = 0.3 * std::pow(g.dx, 3);
  take_up_momentum(g, {{Vec3(0.47, 0.51, 0.33), Vec3(1.0, -2.0, -3.0), volume}}, held, u);
  const double expected[3] = {0.3, -0.6, -0.9};
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(sum_by_plane(u[a]), expected[a], 1e-14);
}

}  // namespace
}  // namespace archetide
