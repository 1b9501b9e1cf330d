#include "runtime/grid/grid.h"

#include <gtest/gtest.h>

#include <cmath>

namespace archetide {
namespace {

Grid small_grid() {
  Grid g;
  g.nx = 5, g.ny = 4, g.nz = 6, g.dx = 0.25, g.origin = Vec3(-1.0, 0.5, 2.0);
  return g;
}

template <class F>
void for_each_index(int nx, int ny, int nz, const F& f) {
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) f(i, j, k);
}

// A function that trilinear interpolation reproduces exactly.
double trilinear(const Vec3& x) {
  return 1.0 + 2.0 * x[0] - x[1] + 0.5 * x[2] + 0.3 * x[0] * x[1] * x[2] - x[1] * x[2];
}
Vec3 trilinear_gradient(const Vec3& x) {
  return {2.0 + 0.3 * x[1] * x[2], -1.0 + 0.3 * x[0] * x[2] - x[2], 0.5 + 0.3 * x[0] * x[1] - x[1]};
}

Array3<double> sampled(const Grid& g) {
  Array3<double> a(g.nx, g.ny, g.nz);
  for_each_index(g.nx, g.ny, g.nz,
                 [&](int i, int j, int k) { a(i, j, k) = trilinear(g.cell_centre(i, j, k)); });
  return a;
}

TEST(Array3, IndexRunsFastestAlongX) {
  const Array3<int> a(3, 4, 5, 7);
  EXPECT_EQ(a.size(), 60u);
  EXPECT_EQ(a.index(1, 0, 0), 1u);
  EXPECT_EQ(a.index(0, 1, 0), 3u);
  EXPECT_EQ(a.index(0, 0, 1), 12u);
  EXPECT_EQ(a(2, 3, 4), 7);
  EXPECT_TRUE(a.contains(2, 3, 4));
  EXPECT_FALSE(a.contains(3, 0, 0));
  EXPECT_FALSE(a.contains(0, -1, 0));
}

TEST(Array3, SwapExchangesShapesAndValues) {
  Array3<int> a(2, 1, 1, 5), b(1, 3, 1, 6);
  a.swap(b);
  EXPECT_EQ(a.ny(), 3);
  EXPECT_EQ(a(0, 2, 0), 6);
  EXPECT_EQ(b.size(), 2u);
}

TEST(Grid, FacesLieHalfACellBelowTheCentres) {
  const Grid g = small_grid();
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 offset = g.cell_centre(1, 2, 3) - g.face_centre(axis, 1, 2, 3);
    EXPECT_DOUBLE_EQ(offset[axis], 0.5 * g.dx);
    offset[axis] = 0.0;
    EXPECT_EQ(offset.norm(), 0.0);
  }
  EXPECT_EQ(g.cells(), 120u);
  EXPECT_DOUBLE_EQ((g.high() - g.low())[2], 6 * 0.25);
}

TEST(Grid, FaceFieldHasOneMoreFaceAlongItsAxis) {
  const FaceField<int> f(small_grid(), 3);
  EXPECT_EQ(f[0].nx(), 6);
  EXPECT_EQ(f[1].ny(), 5);
  EXPECT_EQ(f[2].nz(), 7);
  EXPECT_EQ(f[2].nx(), 5);
  EXPECT_EQ(f[1](4, 4, 5), 3);
}

TEST(Interpolation, ReproducesTrilinearFunctionsBetweenTheCentres) {
  const Grid g = small_grid();
  const Array3<double> a = sampled(g);
  const Vec3 low = g.cell_centre(0, 0, 0), high = g.cell_centre(g.nx - 1, g.ny - 1, g.nz - 1);
  for (double s : {0.0, 0.13, 0.5, 0.77, 1.0})
    for (double t : {0.0, 0.31, 0.62, 1.0}) {
      const Vec3 x = low + (high - low).cwiseProduct(Vec3(s, t, 0.4 * s + 0.6 * t));
      // The coefficients are of order 1 and x of order 3: a few units in the last place of 10.
      EXPECT_NEAR(interpolate(g, a, x), trilinear(x), 2e-14);
      EXPECT_LT((interpolate_gradient(g, a, x) - trilinear_gradient(x)).norm(), 2e-13);
    }
}

TEST(Interpolation, IsClampedToTheOutermostCentres) {
  const Grid g = small_grid();
  const Array3<double> a = sampled(g);
  EXPECT_EQ(interpolate(g, a, g.low() - Vec3(9, 9, 9)), a(0, 0, 0));
  EXPECT_EQ(interpolate(g, a, g.high() + Vec3(9, 9, 9)), a(4, 3, 5));
}

TEST(Interpolation, OneCellThickGridsRepeatTheirValue) {
  Grid g = small_grid();
  g.ny = 1;
  const Array3<double> a = sampled(g);
  const Vec3 x = g.cell_centre(2, 0, 3);
  EXPECT_DOUBLE_EQ(interpolate(g, a, x + Vec3(0, 0.1, 0)), a(2, 0, 3));
  EXPECT_EQ(interpolate_gradient(g, a, x)[1], 0.0);
}

TEST(Interpolation, VelocitiesAreTakenAtTheirFaces) {
  const Grid g = small_grid();
  MacField u(g);
  for (int axis = 0; axis < 3; ++axis)
    for_each_index(u[axis].nx(), u[axis].ny(), u[axis].nz(), [&](int i, int j, int k) {
      u[axis](i, j, k) = (axis + 1) * trilinear(g.face_centre(axis, i, j, k));
    });
  const Vec3 x = g.cell_centre(2, 1, 3) + Vec3(0.02, -0.07, 0.11);
  const Vec3 v = interpolate(g, u, x);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(v[axis], (axis + 1) * trilinear(x), 5e-14);
    EXPECT_EQ(v[axis], interpolate_component(g, u, axis, x));
  }
  // Normal velocities reach up to the walls.
  const Vec3 wall = g.face_centre(0, 0, 2, 2);
  EXPECT_DOUBLE_EQ(interpolate_component(g, u, 0, wall), u[0](0, 2, 2));
}

TEST(MaxSpeed, IsTheLargestComponent) {
  MacField u(small_grid(), 0.25);
  u[2](3, 2, 6) = -4.5;
  EXPECT_EQ(max_speed(u), 4.5);
}

}  // namespace
}  // namespace archetide
