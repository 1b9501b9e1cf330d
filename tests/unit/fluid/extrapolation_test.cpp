#include "runtime/fluid/extrapolation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

using test::unit_grid;

// Velocity f in the faces inside a ball, garbage outside.
struct Ball {
  Grid g = unit_grid(24, 20, 22, 0.1);
  MacField u{g, 777.0};
  FaceField<unsigned char> valid{g};

  template <class F>
  explicit Ball(const F& f) {
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < u[a].nz(); ++k)
        for (int j = 0; j < u[a].ny(); ++j)
          for (int i = 0; i < u[a].nx(); ++i) {
            const Vec3 x = g.face_centre(a, i, j, k);
            if ((x - Vec3(1.1, 0.9, 1.2)).norm() > 0.5) continue;
            u[a](i, j, k) = f(a, x), valid[a](i, j, k) = 1;
          }
  }
};

TEST(Extrapolation, ReproducesConstantsExactlyAndStopsAfterTheLayers) {
  const double constant[3] = {0.1, -3.7, 1.0 / 3.0};
  for (int layers : {0, 1, 4}) {
    Ball b([&](int a, const Vec3&) { return constant[a]; });
    const FaceField<unsigned char> before = b.valid;
    extrapolate_velocity({&b.u}, b.valid, layers);
    std::size_t reached = 0;
    for (int a = 0; a < 3; ++a)
      for (std::size_t n = 0; n < b.u[a].size(); ++n) {
        ASSERT_LE(b.valid[a][n], layers + 1);
        ASSERT_EQ(b.valid[a][n] == 1, before[a][n] == 1);
        reached += b.valid[a][n] > 1;
        // The mean of six equal numbers rounds by at most 3 units in the last place per layer.
        ASSERT_NEAR(b.u[a][n], b.valid[a][n] ? constant[a] : 0.0, b.valid[a][n] ? 4e-15 : 0.0);
      }
    EXPECT_EQ(reached > 0, layers > 0);
  }
}

TEST(Extrapolation, LayerNumberIsTheStepsFromTheValidFaces) {
  Ball b([](int, const Vec3&) { return 1.0; });
  const FaceField<unsigned char> before = b.valid;
  extrapolate_velocity({&b.u}, b.valid, 3);
  // Along a line of faces that leaves the ball the layers count 2, 3, 4 and then stop.
  const Array3<unsigned char>& v = b.valid[0];
  int i = 11;
  while (before[0](i, 9, 11)) ++i;
  for (int layer = 2; layer <= 4; ++layer, ++i) EXPECT_EQ(v(i, 9, 11), layer);
  EXPECT_EQ(v(i, 9, 11), 0);
}

// Valid below the plane x = 0.5 of a box; f there.
FaceField<unsigned char> half_box(const Grid& g, MacField& u,
                                  const std::function<double(const Vec3&)>& f) {
  FaceField<unsigned char> valid(g);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i) {
          const Vec3 x = g.face_centre(a, i, j, k);
          u[a](i, j, k) = f(x);
          valid[a](i, j, k) = x[0] < 0.5;
        }
  return valid;
}

TEST(Extrapolation, ALinearFieldGoesOnExactlyForTwoLayersAndIsConstantBeyond) {
  const Grid g = unit_grid(16, 6, 6, 1.0 / 16);
  const auto f = [](const Vec3& x) { return 3.0 * x[0] - 2.0 * x[1] + x[2]; };
  MacField u(g);
  FaceField<unsigned char> valid = half_box(g, u, f);
  extrapolate_velocity({&u}, valid, 4);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < u[a].nx(); ++i) {
      const unsigned char layer = valid[a](i, 3, 3);
      if (layer == 0 || layer == 1) continue;
      const double beyond = std::max(layer - 3, 0) * g.dx;  // cells past the second layer
      EXPECT_NEAR(u[a](i, 3, 3), f(g.face_centre(a, i, 3, 3)) - 3.0 * beyond, 1e-12);
    }
}

TEST(Extrapolation, NoiseDoesNotGrow) {
  const Grid g = unit_grid(16, 16, 16, 1.0 / 16);
  MacField u(g);
  FaceField<unsigned char> valid = half_box(g, u, [&](const Vec3& x) {
    return std::cos(M_PI * std::floor(x[0] / g.dx + 0.25));  // +1, -1, +1 ... along x
  });
  extrapolate_velocity({&u}, valid, 5);
  EXPECT_LE(max_speed(u), 1.0);
}

// Along x, halved from face to face away from a wall at i = 12: water that leaves the wall, or comes.
TEST(Extrapolation, WaterThatLeavesAWallIsAtMostAsFastInItAsWallsAre) {
  const Grid g = unit_grid(24, 8, 8, 0.1);
  FaceField<double> open(g, 1.0);
  const Array3<double> phi(g.nx, g.ny, g.nz, -0.5);
  const auto inside = [&](double speed, double wall_speed) {
    MacField u(g, 0.0);
    FaceField<unsigned char> valid(g, 0);
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i <= g.nx; ++i)
          if (i <= 12)
            open[0](i, j, k) = 0.0;
          else
            valid[0](i, j, k) = 1, u[0](i, j, k) = std::ldexp(speed, 13 - i);
    const InSolidsUnderWater solids{phi, 0.4, open, wall_speed};
    extrapolate_velocity({&u}, valid, 2, &solids);
    return std::array<double, 2>{u[0](12, 4, 4), u[0](11, 4, 4)};
  };
  using Two = std::array<double, 2>;
  EXPECT_EQ(inside(8.0, 0.0), (Two{8.0, 8.0}));
  EXPECT_EQ(inside(8.0, 6.0), (Two{8.0, 8.0}));
  EXPECT_EQ(inside(8.0, 10.0), (Two{10.0, 10.0}));
  EXPECT_EQ(inside(8.0, 100.0), (Two{12.0, 16.0}));
  EXPECT_EQ(inside(-8.0, 0.0), (Two{-12.0, -16.0}));
}

TEST(Extrapolation, DoesNotDependOnTheNumberOfThreads) {
  const auto f = [](int a, const Vec3& x) { return std::sin(9 * x[0] + a) * x[1] + x[2]; };
  Ball one(f), two(f);
  test::with_threads(1, [&] { extrapolate_velocity({&one.u}, one.valid, 5); });
  test::with_threads(2, [&] { extrapolate_velocity({&two.u}, two.valid, 5); });
  EXPECT_TRUE(test::same_bits(one.u, two.u));
}

TEST(Extrapolation, PlaneSurfaceGoesOnIntoABodyAsTheSamePlane) {
  const Grid g = unit_grid(24, 24, 24, 0.05);
  for (const Vec3& normal : {Vec3(0, 0, 1), Vec3(1, 2, 2), Vec3(-0.3, 0.1, 0.7)}) {
    const Vec3 n = normal.normalized();
    const auto plane = [&](const Vec3& x) { return n.dot(x - Vec3(0.6, 0.6, 0.6)); };
    Array3<double> phi = test::sample_cells(g, plane);
    Array3<unsigned char> solid(24, 24, 24, 0);
    for (int k = 0; k < 24; ++k)
      for (int j = 0; j < 24; ++j)
        for (int i = 0; i < 24; ++i)
          if (test::sphere(g.cell_centre(i, j, k), Vec3(0.61, 0.58, 0.6), 0.19) < 0)
            solid(i, j, k) = 1, phi(i, j, k) = 9.0;
    extend_level_set(g, phi, solid, 4, 1e9);
    double error = 0.0;
    for (int k = 0; k < 24; ++k)
      for (int j = 0; j < 24; ++j)
        for (int i = 0; i < 24; ++i)
          if (std::abs(plane(g.cell_centre(i, j, k))) < 0.5 * g.dx &&
              test::sphere(g.cell_centre(i, j, k), Vec3(0.61, 0.58, 0.6), 0.19) > -g.dx)
            error = std::max(error, std::abs(phi(i, j, k) - plane(g.cell_centre(i, j, k))));
    EXPECT_LT(error, 1e-13);  // round-off; measured below 1e-15. Where the surface meets the body.
  }
}

}  // namespace
}  // namespace archetide
