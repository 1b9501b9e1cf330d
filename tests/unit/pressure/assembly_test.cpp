// What an assembly takes over from the last one is what it would have found.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

template <class T>
void expect_same(const Array3<T>& a, const Array3<T>& b, const char* what) {
  ASSERT_EQ(a.size(), b.size());
  std::size_t other = 0;
  for (std::size_t n = 0; n < a.size(); ++n) other += a[n] != b[n];
  EXPECT_EQ(other, 0u) << what;
}

// Waves that a ball crosses beside an obstacle; in the second half of the steps the water falls to
// the ball's depth and rises again, so that rows become air, mixed, and inner ones.
TEST(Assembly, OfAStepIsThatFromNothing) {
  constexpr int n = 24, kSteps = 12;
  for (const bool open_top : {false, true}) {
    CoupledTank tank(n, 0.5);
    CouplingOptions options = tank.options;
    const Grid g = options.grid;
    options.hydrostatics.gravity = Vec3(0, 0, -9.81);
    options.open_side[kZMax] = open_top;
    TriMesh post = box_surface(Vec3(0.11, 0.13, 0.37), 2);
    for (Vec3& v : post.vertices) v += Vec3(-0.31, 0.27, -0.2);
    ReducedBody ball = make_body(rigid_surface_archetype(volume_true_sphere(3, 0.13), 500.0), 0);
    Coupling kept(options, {post}), fresh(options, {post});
    MacField u(g, 0.0), u_fresh = u;
    std::size_t inner = 0, air = 0;
    for (int step = 0; step < kSteps; ++step) {
      const double level = 0.3 - 0.5 * std::abs(std::sin(0.4 * std::max(step - kSteps / 2, 0)));
      for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
          for (int i = 0; i < n; ++i) {
            const Vec3 x = g.cell_centre(i, j, k);
            tank.phi(i, j, k) = x[2] - level - 0.02 * std::cos(9.0 * x[0] + step);
          }
      ball.position = Vec3(-0.2 + 0.04 * step, -0.1, -0.02 * step);
      fresh.set_tank(g, options.open_side);  // forgets all but the pressure
      std::vector<StageResult> results;
      const std::vector<StageBody> stage = {{&ball, current_configuration(ball), {}, false, {}}};
      kept.couple(Stage::kPositionHalf, 0.01, {&tank.phi}, stage, u, results);
      fresh.couple(Stage::kPositionHalf, 0.01, {&tank.phi}, stage, u_fresh, results);

      const PressureSystem &a = kept.system(), &b = fresh.system();
      EXPECT_EQ(a.unknowns, b.unknowns);
      EXPECT_EQ(a.surface_mean, b.surface_mean);
      expect_same(a.matrix.kind, b.matrix.kind, "kind");
      expect_same(a.matrix.diag, b.matrix.diag, "diagonal");
      expect_same(a.surface_rhs, b.surface_rhs, "surface values");
      expect_same(a.surface_weight, b.surface_weight, "surface coefficients");
      for (int axis = 0; axis < 3; ++axis) {
        expect_same(a.matrix.w[axis], b.matrix.w[axis], "coefficient");
        expect_same(kept.valid()[axis], fresh.valid()[axis], "solved faces");
        expect_same(u[axis], u_fresh[axis], "velocity");
      }
      for (const RowKind row : a.rows) inner += row == RowKind::kInner, air += row == RowKind::kAir;
      for (const RowKind row : b.rows) EXPECT_EQ(row, RowKind::kMixed);
    }
    // Of all rows: those without a neighbour in the air, the ball or the post (measured 0.14), and
    // those of air.
    EXPECT_GT(inner, static_cast<std::size_t>(kSteps) * n * n / 10);
    EXPECT_GT(air, static_cast<std::size_t>(kSteps) * n * n / 10);
  }
}

}  // namespace
}  // namespace archetide
