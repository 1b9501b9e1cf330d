#include "runtime/fluid/level_set.h"

#include <gtest/gtest.h>

#include "runtime/fluid/redistance.h"
#include "runtime/fluid/tricubic.h"
#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

using test::sample_cells;
using test::unit_grid;

// Volume of n . x < d inside the unit cube [0,1]^3 by inclusion and exclusion over its corners, n >
// 0.
double cube_below_plane(const Vec3& n, double d) {
  double sum = 0.0;
  for (int c = 0; c < 8; ++c) {
    const double rest = d - ((c & 1) * n[0] + (c >> 1 & 1) * n[1] + (c >> 2) * n[2]);
    const int bits = (c & 1) + (c >> 1 & 1) + (c >> 2);
    sum += (bits % 2 ? -1 : 1) * std::pow(std::max(rest, 0.0), 3);
  }
  return sum / (6 * n[0] * n[1] * n[2]);
}

TEST(HalfSpaceFraction, EqualsTheClosedFormAndIsComplementary) {
  for (const Vec3& n : {Vec3(1, 1, 1), Vec3(0.2, 0.5, 0.9), Vec3(0.7, 0.1, 0.2)})
    for (double d = -0.1; d < 2.6; d += 0.0371) {
      // The cube about 0: n . (x + 1/2) < d.
      const double value = 0.5 * n.sum() - d;
      EXPECT_NEAR(half_space_fraction(value, n), std::clamp(cube_below_plane(n, d), 0.0, 1.0),
                  2e-14);
      EXPECT_NEAR(half_space_fraction(value, n) + half_space_fraction(-value, n), 1.0, 2e-15);
      EXPECT_NEAR(half_space_fraction(value, Vec3(-n[2], n[0], -n[1])),
                  half_space_fraction(value, n), 2e-15);
    }
}

TEST(HalfSpaceFraction, StaysExactForNearlyAlignedPlanes) {
  // With slopes (1, e, e') the fraction about a centred plane is 1/2 - value as long as the plane
  // cuts only the sides.
  for (double e : {0.0, 1e-300, 1e-17, 1e-12, 1e-8, 1e-4})
    EXPECT_NEAR(half_space_fraction(0.123, Vec3(e, 1.0, 0.5 * e)), 0.5 - 0.123, 1e-15);
  EXPECT_EQ(half_space_fraction(-1e-9, Vec3::Zero()), 1.0);
  EXPECT_EQ(half_space_fraction(1e-9, Vec3::Zero()), 0.0);
}

TEST(WaterVolume, IsExactForPlanesOfAnyTilt) {
  const Grid g = unit_grid(16, 16, 16, 1.0 / 16);
  for (const Vec3& normal :
       {Vec3(1, 1, 1), Vec3(0.3, 1, 0.2), Vec3(1e-9, 1e-3, 1), Vec3(1, 2e-6, 3e-6)})
    for (double t : {0.31, 0.5, 0.77}) {
      const Vec3 n = normal.normalized();
      const double d = t * n.sum();
      const Array3<double> phi = sample_cells(g, [&](const Vec3& x) { return n.dot(x) - d; });
      // 1e-12 except that the inclusion-exclusion reference itself cancels for tiny components.
      const double reference = normal.minCoeff() < 1e-2 ? half_space_fraction(0.5 * n.sum() - d, n)
                                                        : cube_below_plane(n, d);
      EXPECT_NEAR(water_volume(g, phi), reference, 1e-12);
    }
}

TEST(WaterVolume, IsSecondOrderForASphere) {
  double error[3];
  for (int level = 0; level < 3; ++level) {
    const int n = 20 << level;
    const Grid g = unit_grid(n, n, n, 1.0 / n);
    const Array3<double> phi = sample_cells(
        g, [](const Vec3& x) { return test::sphere(x, Vec3(0.51, 0.48, 0.503), 0.33); });
    error[level] = std::abs(water_volume(g, phi) / (4.0 / 3.0 * M_PI * std::pow(0.33, 3)) - 1);
    std::printf("R = %.1f dx: relative volume error %.2e\n", 0.33 * n, error[level]);
  }
  EXPECT_GT(std::log2(error[0] / error[2]) / 2, 1.8);  // measured 2.0
  EXPECT_LT(error[0], 1e-2);
}

TEST(WaterVolume, IsWhatSolidsLeave) {
  const Grid g = unit_grid(8, 8, 8, 0.5);
  const Array3<double> phi = sample_cells(g, [](const Vec3& x) { return x[2] - 1.7; });
  Array3<double> solid(8, 8, 8, 0.0);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j) solid(3, j, k) = 0.75;
  EXPECT_NEAR(water_volume(g, phi, &solid), 4.0 * 1.7 * (4.0 - 0.75 * 0.5), 1e-12);
}

TEST(LevelSetAdvection, AtRestNothingChanges) {
  const Grid g = unit_grid(16, 12, 14, 0.1);
  Array3<double> phi =
      sample_cells(g, [](const Vec3& x) { return test::sphere(x, Vec3(0.7, 0.6, 0.65), 0.3); });
  const Array3<double> before = phi;
  advect_level_set(g, MacField(g, 0.0), 0.1, phi, 1e9);
  EXPECT_TRUE(test::same_bits(phi, before));
}

TEST(LevelSetAdvection, TranslatesPlanesExactly) {
  const Grid g = unit_grid(24, 24, 24, 1.0 / 24);
  const Vec3 n = Vec3(0.3, -0.4, 0.8).normalized(), u(0.5, 0.2, -0.7);
  const auto plane = [&](const Vec3& x) { return n.dot(x - Vec3(0.5, 0.5, 0.5)); };
  Array3<double> phi = sample_cells(g, plane);
  const double dt = 1.3 * g.dx;
  advect_level_set(g, test::sample_faces(g, [&](int a, const Vec3&) { return u[a]; }), dt, phi,
                   1e9);
  for (int k = 2; k < 22; ++k)
    for (int j = 2; j < 22; ++j)
      for (int i = 2; i < 22; ++i)
        ASSERT_NEAR(phi(i, j, k), plane(g.cell_centre(i, j, k) - dt * u), 1e-14);
}

TEST(LevelSetAdvection, AirComesInThroughAnOpenSide) {
  const Grid g = unit_grid(4, 4, 16, 0.1);
  const MacField down =
      test::sample_faces(g, [](int a, const Vec3&) { return a == 2 ? -1.0 : 0.0; });
  Sides open_side{};
  open_side[5] = true;
  Array3<double> open = sample_cells(g, [](const Vec3&x) { return x[2] - 1.6; }), closed = open;
  for (int s = 0; s < 10; ++s) {
    advect_level_set(g, down, 0.05, open, 1e9, open_side);
    advect_level_set(g, down, 0.05, closed, 1e9);
  }
  // 0.5 m of air above the height 1.1 m: a plane, exact.
  for (int k = 0; k < 16; ++k)
    EXPECT_NEAR(open(1, 2, k), g.cell_centre(1, 2, k)[2] - 1.1, 1e-12) << k;
  // A full tank, which has no surface yet: the side is one.
  Array3<double> full(4, 4, 16, -0.5);
  for (int s = 0; s < 10; ++s) advect_level_set(g, down, 0.01, full, 1e9, open_side);
  EXPECT_GT(full(1, 2, 15), 0.0);
  EXPECT_LT(full(1, 2, 13), 0.0);
  EXPECT_LT(closed(1, 2, 15), 0.0);
}

TEST(LevelSetAdvection, IsAtLeastSecondOrderForASmoothFunction) {
  double error[2];
  for (int level : {0, 1}) {
    const int n = 32 << level;
    const Grid g = unit_grid(n, n, 4, 1.0 / n);
    const auto bump = [](const Vec3& x) {
      return 0.1 - 0.4 * std::exp(-90 * (Vec3(x[0] - 0.62, x[1] - 0.5, 0)).squaredNorm());
    };
    const MacField u = test::sample_faces(g, [](int a, const Vec3& x) {
      return a == 0 ? -(x[1] - 0.5) * 2 * M_PI : a == 1 ? (x[0] - 0.5) * 2 * M_PI : 0.0;
    });
    Array3<double> phi = sample_cells(g, bump);
    const Array3<double> before = phi;
    const int steps = 2 * n;
    for (int s = 0; s < steps; ++s) advect_level_set(g, u, 1.0 / steps, phi, 1e9);
    error[level] = 0.0;
    for (std::size_t c = 0; c < phi.size(); ++c)
      error[level] += std::abs(phi[c] - before[c]) / phi.size();
  }
  const double order = std::log2(error[0] / error[1]);
  std::printf("one turn: L1 error %.2e, %.2e, order %.2f\n", error[0], error[1], order);
  EXPECT_GT(order, 1.9);
}

// Eight at once against one at a time: places on both sides of the points, and on them.
TEST(LevelSet, TricubicValuesOfEightPointsAreThoseOfEach) {
  Array3<double> f(16, 5, 5);
  for (std::size_t n = 0; n < f.size(); ++n) f[n] = std::sin(1.7 * static_cast<double>(n));
  for (const double most : {0.0, 0.3, 0.99}) {
    Block d[3], values;
    for (int a = 0; a < 3; ++a)
      for (int l = 0; l < kBlock; ++l) d[a][l] = most * std::cos(3.0 * l + a);
    tricubic_block(&f(4, 2, 2), strides(f), d, values);
    for (int l = 0; l < kBlock; ++l) {
      const double s[3] = {4 + l + d[0][l], 2 + d[1][l], 2 + d[2][l]};
      EXPECT_NEAR(values[l], tricubic(f, s), 1e-13) << most << ' ' << l;
    }
  }
}

}  // namespace
}  // namespace archetide
