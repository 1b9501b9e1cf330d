#include "runtime/fluid/air_extension.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "runtime/fluid/extrapolation.h"

namespace archetide {
namespace {

// A standing wave over deep water, k = 2 pi / L, in a tank of 1 m; a bubble where asked for.
struct Wave {
  Grid g;
  Array3<double> phi;
  FaceField<double> open;
  FaceField<unsigned char> solved;
  MacField u;

  static Vec3 velocity(const Vec3& x) {
    const double k = 2.0 * M_PI, e = std::exp(k * (x[2] - 0.5));
    return e * Vec3(std::sin(k * x[0]), 0.0, -std::cos(k * x[0]));
  }

  Wave(int n, bool bubble) {
    g.nx = g.nz = n, g.ny = 4, g.dx = 1.0 / n;
    phi.resize(n, 4, n);
    open.resize(g, 1.0);
    solved.resize(g, 0);
    u.resize(g, 0.0);
    close_sides(g, {}, open);
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < n; ++i) {
          const Vec3 x = g.cell_centre(i, j, k);
          phi(i, j, k) = x[2] - 0.5 - 0.02 * std::cos(2.0 * M_PI * x[0]);
          if (bubble && Vec3(x - Vec3(0.5, x[1], 0.3)).norm() < 2.2 * g.dx) phi(i, j, k) = g.dx;
        }
    for (int a = 0; a < 3; ++a)
      for (int k = 0; k < u[a].nz(); ++k)
        for (int j = 0; j < u[a].ny(); ++j)
          for (int i = 0; i < u[a].nx(); ++i) {
            const int low[3] = {i - (a == 0), j - (a == 1), k - (a == 2)};
            const bool wet =
                (phi.contains(i, j, k) && phi(i, j, k) < 0.0) ||
                (phi.contains(low[0], low[1], low[2]) && phi(low[0], low[1], low[2]) < 0.0);
            if (!wet || open[a](i, j, k) == 0.0) continue;
            solved[a](i, j, k) = 1;
            u[a](i, j, k) = velocity(g.face_centre(a, i, j, k))[a];
          }
    FaceField<unsigned char> valid = solved;
    extrapolate_velocity({&u}, valid, 5);
    close_sides(g, {}, u);
  }

  double divergence(int i, int j, int k) const {  // 1/s
    return (u[0](i + 1, j, k) - u[0](i, j, k) + u[1](i, j + 1, k) - u[1](i, j, k) +
            u[2](i, j, k + 1) - u[2](i, j, k)) /
           g.dx;
  }
  // Over the air cells within `reach` of the surface.
  double largest_divergence(double reach) const {
    double largest = 0.0;
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i < g.nx; ++i)
          if (phi(i, j, k) >= 0.0 && phi(i, j, k) < reach)
            largest = std::max(largest, std::abs(divergence(i, j, k)));
    return largest;
  }
};

TEST(AirExtension, IsFreeOfDivergenceAndKeepsWhatWasSolved) {
  Wave wave(48, false);
  const MacField before = wave.u;
  const double reach = 2.5 * wave.g.dx, first = wave.largest_divergence(reach);
  const int iterations =
      make_air_divergence_free(wave.g, wave.phi, wave.open, wave.solved, reach, 1.5, wave.u);
  const double last = wave.largest_divergence(reach);
  std::printf("%d iterations, divergence %.3g -> %.3g 1/s\n", iterations, first, last);
  EXPECT_LT(last,
            1e-2 * first);  // 1e-3 in the norm of the solve; the largest cell a few times that
  EXPECT_LE(iterations, 30);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < before[a].size(); ++n)
      if (wave.solved[a][n]) {
        ASSERT_EQ(wave.u[a][n], before[a][n]);
      }
}

// The wave's own continuation into the air is known: faces of the first layer are second order.
TEST(AirExtension, GoesOnLikeTheWave) {
  double error[2];
  for (int level : {0, 1}) {
    Wave wave(32 << level, false);
    make_air_divergence_free(wave.g, wave.phi, wave.open, wave.solved, 2.5 * wave.g.dx, 1.5,
                             wave.u);
    error[level] = 0.0;
    const Array3<double>& w = wave.u[2];
    for (int k = 1; k < wave.g.nz; ++k)
      for (int i = 0; i < wave.g.nx; ++i)
        if (!wave.solved[2](i, 1, k) && wave.solved[2](i, 1, k - 1))
          error[level] =
              std::max(error[level],
                       std::abs(w(i, 1, k) - Wave::velocity(wave.g.face_centre(2, i, 1, k))[2]));
  }
  const double order = std::log2(error[0] / error[1]);
  std::printf("first face in the air: error %.2e, %.2e m/s of 1, order %.2f\n", error[0], error[1],
              order);
  EXPECT_GT(order, 1.5);
}

// Two walls of water close a slot of one cell at 1 m/s each. Without divergence its air would leave
// with 2 m/s more from every layer; water that comes into it next would take that over.
TEST(AirExtension, AClosingSlotShootsNothingOut) {
  Wave wave(24, false);
  const int slot = 12, bottom = 6, top = 18;  // top: open air from here on
  for (int k = 0; k < 24; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 24; ++i)
        wave.phi(i, j, k) =
            k >= top || (i == slot && k >= bottom) ? 0.5 * wave.g.dx : -0.5 * wave.g.dx;
  for (int a = 0; a < 3; ++a) wave.u[a].fill(0.0), wave.solved[a].fill(0);
  for (int k = 0; k < top; ++k)
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i <= 24; ++i) {
        wave.solved[0](i, j, k) = 1;
        wave.u[0](i, j, k) = i <= slot ? 1.0 : -1.0;
      }
      for (int i = 0; i < 24; ++i)
        wave.solved[1](i, j, k) = wave.solved[2](i, j, k) = i != slot || k < bottom;
    }
  make_air_divergence_free(wave.g, wave.phi, wave.open, wave.solved, wave.g.dx, 1.5, wave.u);
  const double outlet = wave.u[2](slot, 1, top);
  std::printf("%.2f m/s at the outlet\n", outlet);
  EXPECT_GT(outlet, 1.0);
  EXPECT_LE(outlet, 1.5);  // the bound of the function, times the fastest face, 1 m/s
}

// A bubble that closes has no divergence-free velocity: nothing grows in it.
TEST(AirExtension, ABubbleIsLeftToClose) {
  Wave wave(48, true);
  double fastest = 0.0;
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < wave.u[a].size(); ++n)
      fastest = std::max(fastest, std::abs(wave.u[a][n]));
  make_air_divergence_free(wave.g, wave.phi, wave.open, wave.solved, 2.5 * wave.g.dx, 1.5, wave.u);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < wave.u[a].size(); ++n)
      ASSERT_LE(std::abs(wave.u[a][n]), 1.5 * fastest);
}

TEST(AirExtension, NoAirOrNoTankChangesNothing) {
  Wave wave(16, false);
  const MacField before = wave.u;
  wave.phi.fill(-1.0);
  EXPECT_EQ(make_air_divergence_free(wave.g, wave.phi, wave.open, wave.solved, 0.1, 1.5, wave.u),
            0);
  for (int a = 0; a < 3; ++a)
    for (std::size_t n = 0; n < before[a].size(); ++n) ASSERT_EQ(wave.u[a][n], before[a][n]);
}

}  // namespace
}  // namespace archetide
