#include "runtime/fluid/damping.h"

#include <gtest/gtest.h>

#include "tests/support/fluid_fields.h"

namespace archetide {
namespace {

TEST(Damping, SlowsByItsLawAndNothingElse) {
  const Grid g = test::unit_grid(20, 10, 4, 0.05);
  Damping beach;
  EXPECT_FALSE(beach.any());
  beach.width = {0.25, 0.0, 0.0, 0.2};
  beach.rate = 3.0, beach.drag = 0.5;
  EXPECT_TRUE(beach.any());
  MacField u = test::sample_faces(g, [](int a, const Vec3&) { return a + 1.0; });
  FaceField<unsigned char> target(g, 1);
  target[2](0, 9, 1) = 0;
  const double dt = 0.1;
  const Array3<double> held(g.nx, g.ny, g.nz, 0.5);
  const double taken = damp(g, beach, dt, target, held, u);
  double expected = 0.0;  // of half of each cell, and of the faces in the sides half of that
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i) {
          const Vec3 x = g.face_centre(a, i, j, k);
          const double s = std::max({1.0 - x[0] / 0.25, 1.0 - (0.5 - x[1]) / 0.2, 0.0});
          const double kept = target[a](i, j, k) ? std::exp(-(0.5 + 3.0 * s * s) * dt) : 1.0;
          EXPECT_NEAR(u[a](i, j, k), kept * (a + 1.0), 1e-14);
          const Vec3i face(i, j, k);
          const double mass = face[a] == 0 || face[a] == g.size(a) ? 0.25 : 0.5;
          expected += 0.5 * mass * (a + 1.0) * (a + 1.0) * (1.0 - kept * kept);
        }
  EXPECT_NEAR(taken, expected * g.dx * g.dx * g.dx, 1e-12 * taken);
}

}  // namespace
}  // namespace archetide
