#include "runtime/numerics/poisson_operator.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "runtime/numerics/components.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/pcg.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

constexpr double kTermRounding = 1e-14;  // a dozen operations on numbers of size 1 in fp64

std::vector<PoissonMatrix> small_matrices() {
  std::vector<PoissonMatrix> all;
  all.push_back(random_matrix(5, 7, 3, 1));
  all.push_back(random_matrix(7, 4, 6, 2, {true, false, false, true, true, true}));
  all.push_back(random_matrix(1, 1, 40, 3, {false, false, false, false, false, true}));
  all.push_back(make_matrix({24, 10, 12, 0.6, 1.5, {{Vec3(12, 5, 4), 2.7}}}));
  all.push_back(make_matrix({40, 9, 9, 2.0}));
  return all;
}

TEST(PoissonMatrix, ProductIsThatOfTheDefinition) {
  for (const PoissonMatrix& a : small_matrices()) {
    const std::vector<double> x = random_vector(a, 5);
    std::vector<double> y(a.size(), 7.0);
    a.apply(x.data(), y.data());
    const VecX expected = dense_matrix(a) * gather(a, x);
    EXPECT_LT((gather(a, y) - expected).norm(), kTermRounding * (1.0 + expected.norm()));
    for (std::size_t n = 0; n < a.size(); ++n)
      EXPECT_TRUE(a.kind[n] == CellKind::kUnknown || y[n] == 0.0);
  }
}

TEST(PoissonOperator, ProductEqualsThatOfTheMatrixAndReadsUnknownsOnly) {
  for (const PoissonMatrix& a : small_matrices()) {
    PoissonOperator op;
    op.setup(a);
    std::vector<double> x = random_vector(a, 6), y(a.size(), 0.0), expected(a.size());
    a.apply(x.data(), expected.data());
    for (std::size_t n = 0; n < a.size(); ++n)
      if (a.kind[n] != CellKind::kUnknown) x[n] = std::numeric_limits<double>::quiet_NaN();
    op.apply(x.data(), y.data());
    for (std::size_t n = 0; n < a.size(); ++n) EXPECT_NEAR(y[n], expected[n], kTermRounding * 10.0);
  }
}

TEST(PoissonOperator, BlocksCoverEveryUnknown) {
  for (const PoissonMatrix& a : small_matrices()) {
    PoissonOperator op;
    op.setup(a);
    std::vector<double> ones(a.size(), 0.0);
    std::size_t unknowns = 0;
    for (std::size_t n = 0; n < a.size(); ++n)
      if (a.kind[n] == CellKind::kUnknown) ones[n] = 1.0, ++unknowns;
    EXPECT_EQ(sum(op.blocks(), ones.data()), static_cast<double>(unknowns));
    EXPECT_EQ(op.unknowns(), unknowns);
  }
}

TEST(PoissonOperator, IsSymmetricAndPositive) {
  for (const PoissonMatrix& a : small_matrices()) {
    PoissonOperator op;
    op.setup(a);
    const std::vector<double> u = random_vector(a, 7), v = random_vector(a, 8);
    std::vector<double> au(a.size(), 0.0), av(a.size(), 0.0);
    op.apply(u.data(), au.data());
    op.apply(v.data(), av.data());
    const double vau = dot(op.blocks(), v.data(), au.data());
    const double uav = dot(op.blocks(), u.data(), av.data());
    const double uau = dot(op.blocks(), u.data(), au.data());
    EXPECT_GT(uau, 0.0);
    EXPECT_NEAR(vau, uav, 1e-13 * uau);
  }
}

// -laplace p = 3 pi^2 p in a full closed tank, p = cos(pi x) cos(pi y) cos(pi z): the error of the
// solution falls with the square of the cell size.
TEST(PoissonOperator, SolutionInAFullTankIsOfSecondOrder) {
  const auto error = [](int n) {
    const PoissonMatrix a = make_matrix({n, n, n, 2.0});
    std::vector<double> b(a.size()), exact(a.size()), x(a.size(), 0.0);
    const double h = 1.0 / n, pi = std::numbers::pi;
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const std::size_t m = a.kind.index(i, j, k);
          exact[m] = std::cos(pi * (i + 0.5) * h) * std::cos(pi * (j + 0.5) * h) *
                     std::cos(pi * (k + 0.5) * h);
          b[m] = 3.0 * pi * pi * exact[m] * h * h;
        }
    PoissonOperator op;
    op.setup(a);
    ClosedComponents closed;
    closed.setup(a);
    Multigrid multigrid;
    multigrid.setup(op, &closed);
    PcgWorkspace workspace;
    PcgOptions options;
    options.tolerance = 1e-11;
    EXPECT_TRUE(
        pcg(ProjectedOperator(op, closed), multigrid, b.data(), x.data(), options, workspace)
            .converged);
    axpy(op.blocks(), -1.0, exact.data(), x.data());
    return max_abs(op.blocks(), x.data());
  };
  const double order = std::log2(error(16) / error(32));
  EXPECT_NEAR(order, 2.0, 0.02);  // next term of the expansion: O(h^2) relative; measured 2.004
}

}  // namespace
}  // namespace archetide::testing
