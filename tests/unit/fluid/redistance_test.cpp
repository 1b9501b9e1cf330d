#include "runtime/fluid/redistance.h"

#include <gtest/gtest.h>

#include "runtime/fluid/level_set.h"
#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

using test::sample_cells;
using test::unit_grid;

double largest_difference(const Array3<double>& a, const Array3<double>& b) {
  double d = 0.0;
  for (std::size_t n = 0; n < a.size(); ++n) d = std::max(d, std::abs(a[n] - b[n]));
  return d;
}

// Largest shift of the crossings along grid lines between two level sets, m.
double interface_shift(const Grid& g, const Array3<double>& a, const Array3<double>& b) {
  const int stride[3] = {1, g.nx, g.nx * g.ny};
  double shift = 0.0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        for (int s : stride) {
          const std::size_t n = a.index(i, j, k);
          if ((a[n] < 0) == (a[n + s] < 0)) continue;
          shift =
              std::max(shift, std::abs(a[n] / (a[n] - a[n + s]) - b[n] / (b[n] - b[n + s])) * g.dx);
        }
  return shift;
}

TEST(Redistance, ReproducesAGridAlignedPlaneAtAnyHeight) {
  const Grid g = unit_grid(10, 8, 30, 0.1);
  const double band = 0.5;
  for (int axis : {0, 1, 2})
    for (double height : {0.3, 0.34, 0.35, 0.3999999, 0.4}) {
      const double scale = 3.0;  // the slope of the input must not matter
      const auto plane = [&](const Vec3& x) { return x[axis] - height; };
      Array3<double> phi = sample_cells(g, [&](const Vec3& x) { return scale * plane(x); });
      redistance(g, phi, band);
      const Array3<double> exact =
          sample_cells(g, [&](const Vec3& x) { return std::clamp(plane(x), -band, band); });
      EXPECT_LT(largest_difference(phi, exact), 1e-14) << axis << ' ' << height;  // measured 3e-16
    }
}

TEST(Redistance, DoesNotTouchAPlaneThatIsADistanceAlready) {
  const Grid g = unit_grid(12, 12, 24, 0.05);
  Array3<double> phi = sample_cells(g, [](const Vec3& x) { return x[2] - 0.6123; });
  redistance(g, phi, 0.25);
  const Array3<double> once = phi;
  for (int repeat = 0; repeat < 5; ++repeat) redistance(g, phi, 0.25);
  EXPECT_TRUE(test::same_bits(phi, once));
}

TEST(Redistance, ReproducesTiltedPlanesAwayFromTheTank) {
  const Grid g = unit_grid(32, 32, 32, 1.0 / 32);
  for (const Vec3& normal : {Vec3(1, 1, 1), Vec3(1, 2, 0), Vec3(0.2, -0.5, 1)}) {
    const auto plane = [&](const Vec3& x) {
      return normal.normalized().dot(x - Vec3(0.51, 0.49, 0.5));
    };
    Array3<double> phi = sample_cells(g, plane);
    redistance(g, phi, 5 * g.dx);
    double error = 0.0;
    for (int k = 8; k < 24; ++k)
      for (int j = 8; j < 24; ++j)
        for (int i = 8; i < 24; ++i) {
          const double exact = plane(g.cell_centre(i, j, k));
          if (std::abs(exact) < 3 * g.dx) error = std::max(error, std::abs(phi(i, j, k) - exact));
        }
    // Upwind differences are exact on planes; what is left comes from the walls. Measured 2e-8 dx.
    EXPECT_LT(error, 1e-6 * g.dx);
  }
}

// The sphere with a wrong slope, (r^2 - R^2)/(2R) times 2: its zero level is exact, its gradient is
// not.
Array3<double> quadric(const Grid& g, double radius) {
  return sample_cells(g, [&](const Vec3& x) {
    return ((x - Vec3(0.503, 0.497, 0.5)).squaredNorm() - radius * radius) / radius;
  });
}

TEST(Redistance, ConvergesToTheDistanceOfASphere) {
  const double radius = 0.3;
  double error[2];
  for (int level : {0, 1}) {
    const int n = 32 << level;
    const Grid g = unit_grid(n, n, n, 1.0 / n);
    Array3<double> phi = quadric(g, radius);
    redistance(g, phi, 5 * g.dx);
    const Array3<double> exact = sample_cells(
        g, [&](const Vec3& x) { return test::sphere(x, Vec3(0.503, 0.497, 0.5), radius); });
    error[level] = 0.0;
    for (std::size_t c = 0; c < phi.size(); ++c)
      if (std::abs(exact[c]) < 4 * g.dx)
        error[level] = std::max(error[level], std::abs(phi[c] - exact[c]));
    std::printf("n = %d: largest error %.2e m = %.4f dx\n", n, error[level], error[level] * n);
  }
  EXPECT_GT(std::log2(error[0] / error[1]), 1.5);
}

TEST(Redistance, KeepsTheInterfaceOfResolvedSpheresInPlace) {
  for (double cells : {6.0, 10.0, 20.0}) {
    const int n = 2 * static_cast<int>(cells) + 16;
    const Grid g = unit_grid(n, n, n, 1.0 / n);
    const double radius = cells / n;
    const Array3<double> exact = sample_cells(
        g, [&](const Vec3& x) { return test::sphere(x, Vec3(0.503, 0.497, 0.5), radius); });
    Array3<double> phi = exact;
    redistance(g, phi, 5 * g.dx);
    const double once = interface_shift(g, phi, exact) / g.dx;
    for (int repeat = 1; repeat < 20; ++repeat) redistance(g, phi, 5 * g.dx);
    const double often = interface_shift(g, phi, exact) / g.dx;
    const double volume = 4.0 / 3.0 * M_PI * std::pow(radius, 3);
    std::printf("R = %g dx: shift %.5f dx, after 20 calls %.5f dx, volume %+.4f %%\n", cells, once,
                often, 100 * (water_volume(g, phi) / volume - 1));
    // Central slopes of a distance are 1 to (dx/R)^2, so the interface cells keep their values.
    EXPECT_LT(once, 1e-9);
    EXPECT_LT(often, 1e-9);
  }
}

TEST(Redistance, MovesTheInterfaceOfADistortedSphereLittle) {
  for (double cells : {6.0, 10.0, 20.0}) {
    const int n = 2 * static_cast<int>(cells) + 16;
    const Grid g = unit_grid(n, n, n, 1.0 / n);
    const Array3<double> before = quadric(g, cells / n);  // slope 2 at the interface
    Array3<double> phi = before;
    redistance(g, phi, 5 * g.dx);
    const double once = interface_shift(g, phi, before) / g.dx;
    for (int repeat = 1; repeat < 20; ++repeat) redistance(g, phi, 5 * g.dx);
    const double often = interface_shift(g, phi, before) / g.dx;
    std::printf("R = %g dx, slope 2: shift %.4f dx, after 20 calls %.4f dx\n", cells, once, often);
    // phi / |grad phi| shifts a crossing by up to phi_nn / (8 phi_n) dx^2 = dx^2 / (8 R) along the
    // normal, sqrt(3) times as much along a grid line; the rest is of higher order.
    EXPECT_LT(once, 2.0 / (8 * cells));   // measured 1.66, 1.80, 1.92 / (8 R)
    EXPECT_LT(often, 2.0 / (8 * cells));  // the same: later calls change nothing
  }
}

TEST(Redistance, CapsWhatIsFarAndKeepsTheSign) {
  const Grid g = unit_grid(40, 40, 40, 1.0 / 40);
  Array3<double> phi = quadric(g, 0.25);
  const Array3<double> before = phi;
  const double band = 4 * g.dx;
  redistance(g, phi, band);
  for (std::size_t n = 0; n < phi.size(); ++n) {
    ASSERT_EQ(phi[n] < 0, before[n] < 0);
    ASSERT_LE(std::abs(phi[n]), band);
  }
  EXPECT_EQ(phi(0, 0, 0), band);
  EXPECT_EQ(phi(20, 20, 20), -band);
}

TEST(Redistance, FullAndEmptyTanksAreCapped) {
  const Grid g = unit_grid(6, 5, 4, 1.0);
  for (double value : {-0.3, 0.3}) {
    Array3<double> phi(6, 5, 4, value);
    redistance(g, phi, 3.0);
    for (std::size_t n = 0; n < phi.size(); ++n) ASSERT_EQ(phi[n], std::copysign(3.0, value));
  }
}

TEST(Redistance, DoesNotDependOnTheNumberOfThreads) {
  const Grid g = unit_grid(40, 36, 44, 1.0 / 40);
  Array3<double> one = quadric(g, 0.3), two = one;
  test::with_threads(1, [&] { redistance(g, one, 5 * g.dx); });
  test::with_threads(2, [&] { redistance(g, two, 5 * g.dx); });
  EXPECT_TRUE(test::same_bits(one, two));
}

}  // namespace
}  // namespace archetide
