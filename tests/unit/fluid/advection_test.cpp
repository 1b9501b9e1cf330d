#include "runtime/fluid/advection.h"

#include <gtest/gtest.h>

#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

using test::unit_grid;

// Solid rotation about the middle of the unit square, one turn per second.
double rotation(int axis, const Vec3& x) {
  return axis == 0 ? -(x[1] - 0.5) * 2 * M_PI : axis == 1 ? (x[0] - 0.5) * 2 * M_PI : 0.0;
}

// A smooth blob carried as the z component.
double blob(const Vec3& x) {
  return std::exp(-90 * Vec3(x[0] - 0.62, x[1] - 0.5, 0).squaredNorm());
}

double turned_blob_error(int n) {
  const Grid g = unit_grid(n, n, 4, 1.0 / n);
  const MacField u = test::sample_faces(g, rotation);
  MacField f = test::sample_faces(g,
                                  [](int a, const Vec3&x) { return a == 2 ? 1 + blob(x) : 0.0; }),
           next(g);
  const MacField exact = f;
  const FaceField<unsigned char> all(g, 1);
  FaceField<unsigned char> target(g, 0);
  target[2].fill(1);
  const int steps = 2 * n;
  for (int s = 0; s < steps; ++s) {
    advect_velocity(g, u, f, 1.0 / steps, all, target, next);
    std::swap(f, next);
  }
  double error = 0.0;
  for (std::size_t c = 0; c < f[2].size(); ++c)
    error += std::abs(f[2][c] - exact[2][c]) / f[2].size();
  return error;
}

// A smooth flow of up to 0.8 cells a step in all directions, u of x, y, z with the axes renamed.
double stirred(int axis, const Vec3& x) {
  const double s = x[(axis + 1) % 3], t = x[(axis + 2) % 3];
  return std::sin(7 * s + axis) * std::cos(5 * t - axis) + 0.3 * std::sin(9 * x[axis]);
}

// Faces in long rows are advected in blocks, those in rows of six one by one: a tank that is 40
// cells long along x and the same tank turned so that 6 cells lie along x give the same.
TEST(VelocityAdvection, BlocksOfARowAreItsFacesOneByOne) {
  const double dx = 1.0 / 40;
  const Grid g = unit_grid(40, 24, 6, dx), turned = unit_grid(6, 40, 24, dx);
  // axis a of g is axis (a + 1) % 3 of the turned tank
  const MacField u = test::sample_faces(g, stirred);
  const MacField v = test::sample_faces(
      turned, [](int a, const Vec3& x) { return stirred((a + 2) % 3, Vec3(x[1], x[2], x[0])); });
  MacField next(g), next_turned(turned);
  const double dt = 0.8 * dx / 1.3;
  advect_velocity(g, u, u, dt, FaceField<unsigned char>(g, 1), FaceField<unsigned char>(g, 1),
                  next);
  advect_velocity(turned, v, v, dt, FaceField<unsigned char>(turned, 1),
                  FaceField<unsigned char>(turned, 1), next_turned);
  double difference = 0.0, change = 0.0;
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < next[a].nz(); ++k)
      for (int j = 0; j < next[a].ny(); ++j)
        for (int i = 0; i < next[a].nx(); ++i) {
          const double here = next[a](i, j, k);
          difference = std::max(difference, std::abs(here - next_turned[(a + 1) % 3](k, i, j)));
          change = std::max(change, std::abs(here - u[a](i, j, k)));
        }
  EXPECT_GT(change, 0.1);
  EXPECT_LT(difference, 1e-13);  // round-off of interpolating numbers of order 1
  std::printf("largest difference %.1e, largest change %.2f\n", difference, change);
}

TEST(VelocityAdvection, IsSecondOrderForASmoothBlob) {
  const double e[3] = {turned_blob_error(32), turned_blob_error(64), turned_blob_error(128)};
  std::printf("one turn: L1 error %.2e %.2e %.2e, order %.2f %.2f\n", e[0], e[1], e[2],
              std::log2(e[0] / e[1]), std::log2(e[1] / e[2]));
  EXPECT_GT(std::log2(e[1] / e[2]), 1.8);
}

TEST(VelocityAdvection, KeepsTheBoundsOfTheSource) {
  const Grid g = unit_grid(24, 24, 24, 1.0 / 24);
  const MacField u = test::sample_faces(g, rotation);
  // A step function: an unlimited second-order scheme overshoots.
  MacField f = test::sample_faces(
               g, [](int, const Vec3&x) { return x[0] > 0.6 && x[1] > 0.4 ? 2.0 : -1.0; }),
           next(g);
  const FaceField<unsigned char> all(g, 1);
  for (int s = 0; s < 30; ++s) {
    advect_velocity(g, u, f, 0.01, all, all, next);
    std::swap(f, next);
    for (int a = 0; a < 3; ++a)
      for (std::size_t n = 0; n < f[a].size(); ++n) {
        ASSERT_GE(f[a][n], -1.0 - 1e-14);
        ASSERT_LE(f[a][n], 2.0 + 1e-14);
      }
  }
}

TEST(VelocityAdvection, ConstantsSurviveInvalidFaces) {
  const Grid g = unit_grid(20, 16, 12, 0.1);
  const MacField u =
      test::sample_faces(g, [](int a, const Vec3& x) { return std::sin(3 * x[0] + 5 * x[1] + a); });
  MacField f(g, 0.7), result(g);
  FaceField<unsigned char> valid(g, 1);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < f[a].size(); n += 7) f[a][n] = 1e30, valid[a][n] = 0;
  advect_velocity(g, u, f, 0.08, valid, valid, result);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < f[a].size(); ++n)
      ASSERT_NEAR(result[a][n], valid[a][n] ? 0.7 : 0.0, 1e-14);
}

TEST(VelocityAdvection, LeavesFacesOutsideTheTargetAlone) {
  const Grid g = unit_grid(10, 10, 10, 0.1);
  const MacField u(g, 0.5), f(g, 1.0);
  MacField result(g, -8.0);
  const FaceField<unsigned char> all(g, 1);
  FaceField<unsigned char> target(g, 0);
  for (int a = 0; a < 3; ++a) target[a](4, 5, 6) = 1;
  advect_velocity(g, u, f, 0.05, all, target, result);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < f[a].size(); ++n)
      ASSERT_EQ(result[a][n], target[a][n] ? 1.0 : -8.0);
}

TEST(VelocityAdvection, StillWaterStaysStill) {
  const Grid g = unit_grid(8, 8, 8, 0.1);
  const MacField zero(g, 0.0);
  MacField result(g, 1.0);
  const FaceField<unsigned char> all(g, 1);
  advect_velocity(g, zero, zero, 0.1, all, all, result);
  EXPECT_EQ(max_speed(result), 0.0);
}

TEST(VelocityAdvection, HugeStepsEndAtTheTank) {
  const Grid g = unit_grid(8, 9, 10, 0.1);
  const MacField u = test::sample_faces(
      g, [](int a, const Vec3& x) { return 100 * std::cos(20 * x[(a + 1) % 3]); });
  MacField result(g);
  const FaceField<unsigned char> all(g, 1);
  advect_velocity(g, u, u, 10.0, all, all, result);
  EXPECT_LE(max_speed(result), 100.0 + 1e-12);
}

TEST(VelocityAdvection, DoesNotDependOnTheNumberOfThreads) {
  const Grid g = unit_grid(24, 20, 22, 0.1);
  const MacField u = test::sample_faces(
      g, [](int a, const Vec3& x) { return std::sin(3 * x[0] + 5 * x[1] * x[2] + a); });
  FaceField<unsigned char> valid(g, 1);
  for (std::size_t n = 0; n < valid[1].size(); n += 11) valid[1][n] = 0;
  MacField one(g), two(g);
  test::with_threads(1, [&] { advect_velocity(g, u, u, 0.1, valid, valid, one); });
  test::with_threads(2, [&] { advect_velocity(g, u, u, 0.1, valid, valid, two); });
  EXPECT_TRUE(test::same_bits(one, two));
}

TEST(CflSpeed, IsTheFastestMarkedFace) {
  const Grid g = unit_grid(4, 4, 4, 1.0);
  MacField u(g, 0.5);
  u[1](2, 3, 1) = -7.0;
  u[2](1, 1, 4) = 3.0;
  EXPECT_EQ(cfl_speed(u), 7.0);
  FaceField<unsigned char> mask(g, 1);
  mask[1](2, 3, 1) = 0;
  EXPECT_EQ(cfl_speed(u, &mask), 3.0);
}

TEST(SpeedOfMost, LeavesOutTheFastestFewUpToAFactor) {
  const Grid g = unit_grid(10, 10, 10, 1.0);  // 3300 faces
  MacField u(g, 0.5);
  u[0](3, 3, 3) = 9.0;  // continued into the air
  u[1](2, 3, 1) = -8.0;
  u[1](2, 5, 1) = 7.0;
  u[2](1, 1, 4) = 3.0;
  FaceField<unsigned char> valid(g, 1);
  valid[0](3, 3, 3) = 2;
  const auto of_most = [&](double spared, double factor) {
    return speed_of_most(u, valid, (spared + 0.5) / 3299.0, factor);
  };
  EXPECT_EQ(of_most(-0.5, 8.0), 9.0);             // share 0
  EXPECT_EQ(of_most(0.0, 8.0), 9.0);              // less than a face
  EXPECT_NEAR(of_most(1.0, 8.0), 7.0, 8.0 / 64);  // in steps of (9 - 9 / 8) / 64
  EXPECT_NEAR(of_most(2.0, 8.0), 3.0, 8.0 / 64);
  EXPECT_EQ(of_most(3.0, 8.0), 9.0 / 8.0);  // 0.5 is slower than that
  EXPECT_EQ(of_most(3.0, 2.0), 4.5);
  test::with_threads(2, [&] { EXPECT_EQ(of_most(1.0, 8.0), of_most(1.0, 8.0)); });
}

}  // namespace
}  // namespace archetide
