#include "runtime/numerics/pcg.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/LU>
#include <Eigen/QR>

#include "runtime/numerics/components.h"
#include "runtime/numerics/multigrid.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

struct Solution {
  std::vector<double> x;
  SolveReport report;
  double true_residual;  // recomputed here from the plain matrix, relative
};

// Solves A x = b (its part in the range of A) from x = 0 with the multigrid.
Solution solve(const PoissonMatrix& a, std::vector<double> b, double tolerance) {
  PoissonOperator op;
  op.setup(a);
  ClosedComponents closed;
  closed.setup(a);
  Multigrid multigrid;
  multigrid.setup(op, &closed);
  PcgWorkspace workspace;
  PcgOptions options;
  options.tolerance = tolerance;
  Solution s{std::vector<double>(a.size(), 0.0), {}, 0.0};
  s.report =
      pcg(ProjectedOperator(op, closed), multigrid, b.data(), s.x.data(), options, workspace);
  const Blocks all = all_blocks(a.size());
  std::vector<double> r(a.size());
  a.apply(s.x.data(), r.data());
  closed.project(b.data());
  subtract_from(all, b.data(), r.data());
  s.true_residual = norm(all, r.data()) / norm(all, b.data());
  return s;
}

// The operator and right-hand sides of a dense matrix, for tests of pcg alone.
struct DenseOperator {
  MatX a;
  std::size_t size() const { return static_cast<std::size_t>(a.rows()); }
  void apply(const double* x, double* y) const {
    Eigen::Map<VecX>(y, a.rows()) = a * Eigen::Map<const VecX>(x, a.rows());
  }
};
struct Identity {
  std::size_t n;
  void apply(const double* r, double* z) const { std::copy(r, r + n, z); }
};

// Symmetric positive definite with eigenvalues from 1 to `condition`.
MatX definite_matrix(int n, double condition) {
  MatX random(n, n);
  std::mt19937 engine(3);
  std::normal_distribution<double> normal;
  for (double& value : random.reshaped()) value = normal(engine);
  const MatX q = Eigen::HouseholderQR<MatX>(random).householderQ();
  const VecX eigenvalues = VecX::LinSpaced(n, 0.0, std::log(condition)).array().exp();
  return q * eigenvalues.asDiagonal() * q.transpose();
}

TEST(Pcg, EqualsADenseSolveOnIrregularDomains) {
  int solved = 0;
  for (unsigned seed = 1; seed <= 10; ++seed)
    for (const Vec3i& n : {Vec3i(5, 7, 3), Vec3i(6, 6, 6), Vec3i(1, 9, 4), Vec3i(11, 2, 3)}) {
      const PoissonMatrix a =
          random_matrix(n[0], n[1], n[2], seed, {false, false, true, false, false, true});
      ClosedComponents closed;
      closed.setup(a);
      if (!closed.empty()) continue;
      const auto b = random_vector(a, seed);
      const Solution s = solve(a, b, 1e-12);
      const VecX expected = dense_matrix(a).partialPivLu().solve(gather(a, b));
      EXPECT_TRUE(s.report.converged);
      EXPECT_LT((gather(a, s.x) - expected).norm(), 1e-10 * expected.norm());
      ++solved;
    }
  EXPECT_GE(solved, 20);
}

TEST(Pcg, ReportsTheTrueResidual) {
  const PoissonMatrix a = make_matrix({40, 40, 40, 0.5, 3.0, random_spheres(5, 40, 40, 20, 1)});
  for (double tolerance : {1e-3, 1e-6, 1e-10}) {
    const Solution s = solve(a, random_vector(a, 1), tolerance);
    EXPECT_TRUE(s.report.converged);
    EXPECT_LE(s.true_residual, tolerance * (1.0 + 1e-6));
    EXPECT_NEAR(s.report.residual, s.true_residual, 1e-3 * tolerance);
  }
}

// Iterations to 1e-6 must not exceed these; the right-hand sides are noise, a constant and gravity.
void expect_iterations(const Tank& tank, int bound) {
  const PoissonMatrix a = make_matrix(tank);
  std::vector<double> constant(a.size(), 0.0), gravity(a.size(), 0.0);
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j)
      for (int i = 0; i < a.nx; ++i) {
        if (a.kind(i, j, k) != CellKind::kUnknown) continue;
        const std::size_t n = a.kind.index(i, j, k);
        constant[n] = i < a.nx / 2 ? 1.0 : 0.5;
        gravity[n] = a.w[2](i, j, k + 1) - a.w[2](i, j, k);
      }
  for (const auto& b : {random_vector(a, 1), constant, gravity}) {
    const Solution s = solve(a, b, 1e-6);
    EXPECT_TRUE(s.report.converged);
    EXPECT_LE(s.report.iterations, bound);
    EXPECT_LE(s.true_residual, 1e-6 * (1.0 + 1e-6));
  }
}

void expect_iterations_of_size(int n) {
  expect_iterations({n, n, n}, 9);                  // measured 6, 8, 8 at 64, 128, 192
  expect_iterations({n, n, n, 0.4, 0.06 * n}, 12);  // measured 9, 10, 10
  expect_iterations({n, n, n, 2.0}, 7);             // measured 6
  expect_iterations({n, n, n, 0.4, 0.06 * n, random_spheres(40, n, n, n * 2 / 5, 8)}, 12);
  expect_iterations({n, n, n, 2.0, 0.0, random_spheres(40, n, n, n, 9)}, 8);
}

TEST(Pcg, IterationsAreFewAt64) { expect_iterations_of_size(64); }
TEST(SlowPcg, IterationsAreFewAt128) { expect_iterations_of_size(128); }
TEST(SlowPcg, IterationsAreFewAt192) { expect_iterations_of_size(192); }

TEST(Pcg, ClosedTankConvergesWithZeroMean) {
  const PoissonMatrix a = make_matrix({32, 24, 28, 2.0, 0.0, random_spheres(3, 32, 24, 28, 2)});
  ClosedComponents closed;
  closed.setup(a);
  ASSERT_EQ(closed.count(), 1u);
  std::vector<double> b = random_vector(a, 1);
  closed.project(b.data());
  const Solution s = solve(a, b, 1e-10);
  EXPECT_TRUE(s.report.converged);
  EXPECT_LE(s.report.iterations, 12);  // measured 9
  EXPECT_NEAR(closed.mean(0, s.x.data()), 0.0, 1e-14 * norm(all_blocks(a.size()), s.x.data()));
}

TEST(Pcg, IncompatibleRightHandSideIsSolvedByItsCompatiblePart) {
  const PoissonMatrix a = make_matrix({16, 16, 16, 2.0});
  std::vector<double> b = random_vector(a, 1);
  const Solution s = solve(a, b, 1e-10);
  for (double& value : b) value += 3.0;
  const Solution shifted = solve(a, b, 1e-10);
  EXPECT_TRUE(shifted.report.converged);
  for (std::size_t n = 0; n < b.size(); ++n) EXPECT_NEAR(shifted.x[n], s.x[n], 1e-8);
}

// Faces open by 1e-6, an interface at 1e-3 of a cell: bounded work, no loss of accuracy.
TEST(Pcg, SliversAreHarmless) {
  PoissonMatrix a = make_matrix({24, 24, 24, 0.6, 2.0});
  std::mt19937 random(5);
  for (auto& component : a.w.axis)
    for (std::size_t n = 0; n < component.size(); ++n)
      if (component[n] > 0.0 && random() % 4 == 0) component[n] = 1e-6;
  for (const Vec3i& c : {Vec3i(5, 6, 7), Vec3i(20, 3, 2), Vec3i(12, 12, 9)})
    for (int axis = 0; axis < 3; ++axis)
      for (int high = 0; high < 2; ++high) {
        Vec3i f = c;
        f[axis] += high;
        a.w[axis](f[0], f[1], f[2]) = 1e-6;  // a cell with slivers all around
      }
  sum_diagonal(a, [&](int, const Vec3i& c, const Vec3i&) { return c[0] % 3 == 0 ? 1e-3 : 0.4; });
  const Solution s = solve(a, random_vector(a, 1), 1e-8);
  EXPECT_TRUE(s.report.converged);
  EXPECT_LE(s.report.iterations, 40);
}

TEST(Pcg, IsolatedCellsAreSolved) {
  // Water in every second cell in air, so that each cell stands alone, and one cell walled in.
  PoissonMatrix a = make_matrix({9, 9, 9, 2.0});
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i)
        if ((i + j + k) % 2) a.kind(i, j, k) = CellKind::kDirichlet;
  for (int axis = 0; axis < 3; ++axis) {
    a.w[axis](4, 4, 4) = 0.0;
    a.w[axis](4 + (axis == 0), 4 + (axis == 1), 4 + (axis == 2)) = 0.0;
  }
  sum_diagonal(a, [](int, const Vec3i&, const Vec3i&) { return 1.0; });
  const auto b = random_vector(a, 1);
  const Solution s = solve(a, b, 1e-10);
  EXPECT_TRUE(s.report.converged);
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (a.kind[n] != CellKind::kUnknown) continue;
    EXPECT_NEAR(s.x[n], a.diag[n] > 0.0 ? b[n] / a.diag[n] : 0.0, 1e-9);
  }
}

TEST(Pcg, AnyShapeOfBox) {
  for (const Vec3i& n : {Vec3i(1, 1, 256), Vec3i(256, 1, 1), Vec3i(1, 200, 3), Vec3i(5, 7, 3),
                         Vec3i(1, 1, 1), Vec3i(2, 65, 31), Vec3i(100, 100, 3)})
    for (double level : {0.7, 2.0}) {
      const PoissonMatrix a = make_matrix({n[0], n[1], n[2], level});
      const Solution s = solve(a, random_vector(a, 1), 1e-10);
      EXPECT_TRUE(s.report.converged) << n.transpose() << " level " << level;
      EXPECT_LE(s.report.iterations, 20);
    }
}

TEST(Pcg, ResultIsBitIdenticalForAnyNumberOfThreads) {
  const PoissonMatrix a = make_matrix({70, 64, 66, 0.8, 3.0, random_spheres(6, 70, 64, 50, 5)});
  const auto b = random_vector(a, 1);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Solution one = solve(a, b, 1e-8);
  omp_set_num_threads(2);
  const Solution two = solve(a, b, 1e-8);
  omp_set_num_threads(threads);
  EXPECT_EQ(one.report.iterations, two.report.iterations);
  EXPECT_EQ(one.x, two.x);
}

TEST(Pcg, AGoodFirstGuessEndsAtOnce) {
  const PoissonMatrix a = make_matrix({16, 16, 16, 0.5});
  const auto b = random_vector(a, 1);
  Solution s = solve(a, b, 1e-10);
  PoissonOperator op;
  op.setup(a);
  Multigrid multigrid;
  multigrid.setup(op);
  PcgWorkspace workspace;
  PcgOptions options;
  options.tolerance = 1e-9;
  const SolveReport again = pcg(op, multigrid, b.data(), s.x.data(), options, workspace);
  EXPECT_TRUE(again.converged);
  EXPECT_EQ(again.iterations, 0);
}

TEST(Pcg, ZeroRightHandSideGivesZero) {
  const DenseOperator op{definite_matrix(20, 10.0)};
  Identity m{20};
  PcgWorkspace workspace;
  const std::vector<double> b(20, 0.0);
  std::vector<double> x(20, 1.0);
  const SolveReport report = pcg(op, m, b.data(), x.data(), {}, workspace);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(x, b);
}

TEST(Pcg, RoundOffRightHandSideIsNotIteratedOn) {
  const DenseOperator op{definite_matrix(20, 10.0)};
  Identity m{20};
  PcgWorkspace workspace;
  const std::vector<double> b(20, 1e-17);
  std::vector<double> x(20, 0.0);
  PcgOptions options;
  options.absolute = 1e-12;
  const SolveReport report = pcg(op, m, b.data(), x.data(), options, workspace);
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(report.iterations, 0);
}

TEST(Pcg, NotConvergingIsReported) {
  const DenseOperator op{definite_matrix(200, 1e6)};
  Identity m{200};
  PcgWorkspace workspace;
  const std::vector<double> b(200, 1.0);
  std::vector<double> x(200, 0.0);
  PcgOptions options;
  options.max_iterations = 10;
  const SolveReport report = pcg(op, m, b.data(), x.data(), options, workspace);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.iterations, 10);
  const double residual = (VecX::Ones(200) - op.a * Eigen::Map<VecX>(x.data(), 200)).norm();
  EXPECT_NEAR(report.residual, residual / std::sqrt(200.0), 1e-10 * residual);
}

// On an ill-conditioned matrix the recursion's residual falls for ever while the true one stalls:
// the report must tell the true one.
TEST(Pcg, AnUnreachableToleranceIsNotClaimed) {
  const DenseOperator op{definite_matrix(60, 1e13)};
  Identity m{60};
  PcgWorkspace workspace;
  const std::vector<double> b(60, 1.0);
  std::vector<double> x(60, 0.0);
  PcgOptions options;
  options.tolerance = 1e-14;
  options.max_iterations = 100000;
  const SolveReport report = pcg(op, m, b.data(), x.data(), options, workspace);
  const double residual =
      (VecX::Ones(60) - op.a * Eigen::Map<VecX>(x.data(), 60)).norm() / std::sqrt(60.0);
  EXPECT_GT(residual, options.tolerance);
  EXPECT_FALSE(report.converged);
  EXPECT_NEAR(report.residual, residual, 0.1 * residual);
}

TEST(Pcg, NotANumberEndsTheSolve) {
  const PoissonMatrix a = make_matrix({16, 16, 16, 0.5});
  auto b = random_vector(a, 1);
  b[3] = std::numeric_limits<double>::quiet_NaN();
  const Solution s = solve(a, b, 1e-8);
  EXPECT_FALSE(s.report.converged);
  EXPECT_LE(s.report.iterations, 1);
}

}  // namespace
}  // namespace archetide::testing
