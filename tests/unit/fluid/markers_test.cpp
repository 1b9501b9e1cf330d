// Passive markers: the midpoint rule's error, and the water's surface.
#include "runtime/fluid/markers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace archetide {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

// u = spin(rho) e_z x (x - centre) about the middle of a unit cube.
template <class Spin>
MacField vortex(const Grid& g, const Spin& spin) {
  MacField u(g, 0.0);
  for (int a = 0; a < 2; ++a)
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i) {
          const Vec3 r = g.face_centre(a, i, j, k) - Vec3::Constant(0.5);
          u[a](i, j, k) = spin(std::hypot(r[0], r[1])) * Vec3(-r[1], r[0], 0.0)[a];
        }
  return u;
}

Grid unit_cube(int n) {
  Grid g;
  g.nx = g.ny = g.nz = n;
  g.dx = 1.0 / n;
  return g;
}

// Distance from its start of a point after one turn in `steps`.
double gap_after_turn(const Grid& g, const MacField& u, const Vec3& start, double turn, int steps) {
  std::vector<Vec3> point = {start};
  for (int i = 0; i < steps; ++i) advect_points(g, u, turn / steps, point);
  return (point[0] - start).norm();
}

// Points that a stream carries out of the tank stay a millionth of a cell inside of every wall.
TEST(Markers, StayInTheTank) {
  const Grid g = unit_cube(8);
  MacField u(g, 0.0);
  for (const double speed : {9.0, -9.0}) {
    for (int a = 0; a < 3; ++a) u[a].fill(speed);
    std::vector<Vec3> point = {Vec3::Constant(0.5)};
    advect_points(g, u, 1.0, point);
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(speed > 0.0 ? 1.0 - point[0][a] : point[0][a], 1e-6 / 8, 1e-15);
  }
}

// Linear interpolation is exact for a rigid rotation. A step of angle z turns by z - z^3/6 and
// stretches by 1 + z^4/8, so a turn of N steps misses by 2 pi R z^2/6 with z = 2 pi / N.
TEST(Markers, RigidRotationMissesByTheMidpointRulesErrorOnly) {
  const Grid g = unit_cube(8);
  const MacField u = vortex(g, [](double) { return 1.0; });
  const double radius = 0.3;
  double before = 0.0;
  for (const int steps : {40, 80, 160}) {
    const double z = kTurn / steps;
    const double gap = gap_after_turn(g, u, Vec3(0.8, 0.5, 0.37), kTurn, steps);
    const double expected = radius * kTurn * z * z / 6.0;
    // next terms: stretch N z^4/8 (at a right angle) and N z^5/40
    EXPECT_NEAR(gap, expected, 0.12 * z * expected + 1e-12) << steps;
    if (before > 0.0) {
      EXPECT_GE(std::log2(before / gap), 1.95);
    }
    before = gap;
  }
}

// A vortex of Gaussian spin: now space counts as well, second order in the cells.
TEST(Markers, SteadyVortexBringsThemBack) {
  const auto spin = [](double rho) { return std::exp(-16.0 * rho * rho); };
  const double rho = 0.2, turn = kTurn / spin(rho);
  double before = 0.0;
  for (const int n : {16, 32, 64}) {
    const Grid g = unit_cube(n);
    const double gap = gap_after_turn(g, vortex(g, spin), Vec3(0.7, 0.5, 0.5), turn, 6 * n);
    if (before > 0.0) {
      EXPECT_GE(std::log2(before / gap), 1.8);
    }
    before = gap;
  }
  EXPECT_LE(before, 0.01 * kTurn * rho);
}

TEST(Markers, StayInTheTankAndInTheWater) {
  const Grid g = unit_cube(8);
  MacField u(g, 3.0);
  std::vector<Vec3> points = {Vec3(0.9, 0.2, 0.5)};
  advect_points(g, u, 0.1, points);
  EXPECT_LE(points[0][0], 1.0);
  EXPECT_NEAR(points[0][1], 0.5, 1e-12);

  // water below a sloping plane
  const Vec3 n = Vec3(0.6, 0.0, 0.8);
  Array3<double> phi(8, 8, 8);
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) phi(i, j, k) = n.dot(g.cell_centre(i, j, k)) - 0.7;
  points = {Vec3(0.5, 0.5, 0.7), Vec3(0.3, 0.5, 0.3)};
  const Vec3 above = points[0], below = points[1];
  return_to_water(g, phi, points);
  const double up = n.dot(above) - 0.7;
  EXPECT_LE((points[0] - (above - (up + 0.01 * g.dx) * n)).norm(), 1e-12);
  EXPECT_EQ(points[1], below);
}

// Eight neighbours move together; each alone must move the same way, by the tank's sides as well,
// and also where they are too far apart for that.
TEST(Markers, NeighboursMoveAsEachDoesAlone) {
  const Grid g = unit_cube(12);
  const MacField u = vortex(g, [](double rho) { return 3.0 - 4.0 * rho; });
  for (const double spread : {0.5, 1.5, 6.0})
    for (const Vec3& corner : {Vec3(0.4, 0.3, 0.6), Vec3(0.0, 0.01, 0.97), Vec3(0.95, 0.9, 0.02)}) {
      std::vector<Vec3> together;
      for (int n = 0; n < 17; ++n) {
        const Vec3 way(n * 7 % 17, n * 5 % 17, n * 3 % 17);
        together.push_back((corner + spread * g.dx / 17.0 * way).cwiseMin(Vec3::Constant(1.0)));
      }
      const std::vector<Vec3> start = together;
      advect_points(g, u, 0.02, together);
      for (std::size_t n = 0; n < start.size(); ++n) {
        std::vector<Vec3> alone = {start[n]};
        advect_points(g, u, 0.02, alone);
        EXPECT_NEAR((together[n] - alone[0]).norm(), 0.0, 1e-14) << spread << ' ' << n;
      }
    }
}

}  // namespace
}  // namespace archetide
