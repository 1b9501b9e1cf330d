#include "runtime/numerics/fused_steps.h"

#include <gtest/gtest.h>

#include "runtime/numerics/multigrid.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

// fp32 directions, fp64 sums: both sides compute the same numbers, up to the order of adding.
constexpr double kRounding = 1e-13;

struct Problem {
  explicit Problem(const PoissonMatrix& m) : matrix(m) {
    op.setup(matrix);
    cycle.setup(op);
    steps.setup(op, cycle.layout());
  }
  // A vector of the grid in the padded layout, rounded to fp32, and back.
  std::vector<float> padded(const std::vector<double>& v) const {
    std::vector<float> out(cycle.layout().size, 0.0f);
    for_unknowns([&](std::size_t n, std::size_t at) { out[at] = static_cast<float>(v[n]); });
    return out;
  }
  std::vector<double> grid(const std::vector<float>& v) const {
    std::vector<double> out(matrix.size(), 0.0);
    for_unknowns([&](std::size_t n, std::size_t at) { out[n] = v[at]; });
    return out;
  }
  template <class F>
  void for_unknowns(F&& f) const {
    for (int k = 0; k < matrix.nz; ++k)
      for (int j = 0; j < matrix.ny; ++j)
        for (int i = 0; i < matrix.nx; ++i)
          if (matrix.kind(i, j, k) == CellKind::kUnknown)
            f(matrix.kind.index(i, j, k), cycle.layout()(i, j, k));
  }
  PoissonMatrix matrix;
  PoissonOperator op;
  Multigrid cycle;
  FusedSteps steps;
};

std::vector<PoissonMatrix> matrices() {
  return {make_matrix({33, 70, 40, 0.6, 3.0, random_spheres(6, 33, 70, 24, 3)}),
          random_matrix(14, 11, 9, 5, {true, false, false, true, false, true}),
          make_matrix({3, 5, 40, 0.7})};
}

TEST(FusedSteps, DirectionIsUpdateProductAndStepInOne) {
  for (const PoissonMatrix& a : matrices()) {
    Problem t(a);
    const auto z = t.padded(random_vector(a, 1));
    auto p = t.padded(random_vector(a, 2));
    const auto p_old = t.grid(p);
    std::vector<double> x = random_vector(a, 3), q(a.size(), 0.0), product(a.size());
    std::vector<double> x_new = x;
    for (std::size_t n = 0; n < x.size(); ++n) x_new[n] += 0.3 * p_old[n];
    const double work = t.steps.direction(0.3, 0.5f, z.data(), 0.25f, p.data(), x.data(), q.data());
    const auto p_new = t.grid(p);
    a.apply(p_new.data(), product.data());
    double expected = 0.0, scale = 0.0;
    t.for_unknowns([&](std::size_t n, std::size_t at) {
      EXPECT_FLOAT_EQ(p[at], 0.5f * z[at] + 0.25f * static_cast<float>(p_old[n]));
      EXPECT_NEAR(q[n], product[n], kRounding * a.diag[n] * 10.0);
      EXPECT_EQ(x[n], x_new[n]);
      expected += p_new[n] * product[n];
      scale += std::abs(p_new[n] * product[n]);
    });
    EXPECT_NEAR(work, expected, kRounding * scale);
  }
}

TEST(FusedSteps, ResidualsAreThoseOfTheMatrix) {
  for (const PoissonMatrix& a : matrices()) {
    Problem t(a);
    const auto b = random_vector(a, 1), x = random_vector(a, 2), q = random_vector(a, 3);
    std::vector<double> r(a.size(), 0.0), product(a.size());
    a.apply(x.data(), product.data());
    const double square = t.steps.residual(b.data(), x.data(), r.data());
    EXPECT_NEAR(square, t.steps.square(r.data()), kRounding * square);
    t.for_unknowns([&](std::size_t n, std::size_t) {
      EXPECT_NEAR(r[n], b[n] - product[n], kRounding * (1.0 + a.diag[n] * 10.0));
    });
    std::vector<double> before = r;
    std::vector<float> rhs(t.cycle.layout().size, 0.0f);
    t.steps.residual_step(0.125, q.data(), r.data(), 4.0, rhs.data());
    t.for_unknowns([&](std::size_t n, std::size_t at) {
      EXPECT_EQ(r[n], before[n] - 0.125 * q[n]);
      EXPECT_EQ(rhs[at], static_cast<float>(4.0 * r[n]));
    });
  }
}

TEST(FusedSteps, CycleInPlaceIsTheCycle) {
  for (const PoissonMatrix& a : matrices()) {
    Problem t(a);
    const auto r = random_vector(a, 1);
    std::vector<double> z(a.size(), 0.0);
    t.cycle.apply(r.data(), z.data());
    t.steps.load(r.data(), 2.0, t.cycle.rhs());  // the cycle is linear: exactly so for powers of 2
    const double work = t.cycle.cycle();
    double expected = 0.0;
    t.for_unknowns([&](std::size_t n, std::size_t at) {
      EXPECT_EQ(t.cycle.iterate()[at], static_cast<float>(2.0 * z[n]));
      expected += static_cast<double>(t.cycle.rhs()[at]) * t.cycle.iterate()[at];
    });
    EXPECT_NEAR(work, expected, kRounding * std::abs(expected) * 10.0);
    // rhs is 2 r rounded to fp32
    EXPECT_NEAR(2.0 * t.steps.work(r.data(), t.cycle.iterate()), work, 1e-6 * work);
  }
}

}  // namespace
}  // namespace archetide::testing
