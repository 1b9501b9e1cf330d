#include "runtime/numerics/multigrid.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <Eigen/Eigenvalues>

#include "runtime/numerics/multigrid_level.h"
#include "tests/unit/numerics/poisson_problems.h"

namespace archetide::testing {
namespace {

// Rounding of fp32 accumulated over a cycle: some 60 operations on a path of eps = 6e-8.
constexpr double kCycleRounding = 4e-6;

// A multigrid and everything it needs, for one matrix.
struct Cycle {
  explicit Cycle(const PoissonMatrix& matrix, bool project = true) {
    op.setup(matrix);
    closed.setup(matrix);
    multigrid.setup(op, project ? &closed : nullptr);
  }
  std::vector<double> apply(const std::vector<double>& r) {
    std::vector<double> z(r.size(), 0.0);
    multigrid.apply(r.data(), z.data());
    return z;
  }
  double dot(const std::vector<double>& a, const std::vector<double>& b) const {
    return archetide::dot(op.blocks(), a.data(), b.data());
  }
  PoissonOperator op;
  ClosedComponents closed;
  Multigrid multigrid;
};

// Sum of the coefficients of the four (or, at the end of an odd side, fewer) fine low faces of
// coarse cell c along an axis, halved where the side has more than one cell.
float sum_of_children(const MultigridLevel& fine, const Vec3i& c, int axis) {
  const Vec3i n(fine.nx, fine.ny, fine.nz);
  Vec3i first = 2 * c, end = (first + Vec3i(2, 2, 2)).cwiseMin(n);
  first[axis] = std::min(first[axis], n[axis]), end[axis] = first[axis] + 1;
  float sum = 0.0f, one;
  for (int k = first[2]; k < end[2]; ++k)
    for (int j = first[1]; j < end[1]; ++j)
      for (int i = first[0]; i < end[0]; ++i) sum += *fine.faces(axis, i, j, k, 1, &one);
  return n[axis] > 1 ? 0.5f * sum : sum;
}

std::vector<PoissonMatrix> matrices_of_all_kinds() {
  std::vector<PoissonMatrix> all;
  all.push_back(make_matrix({32, 32, 32, 0.4, 3.0}));
  all.push_back(make_matrix({33, 21, 19, 0.6, 2.0, random_spheres(6, 33, 21, 12, 3)}));
  all.push_back(make_matrix({24, 24, 24, 2.0, 0.0, random_spheres(6, 24, 24, 24, 4)}));
  all.push_back(random_matrix(14, 11, 9, 5, {true, false, false, true, false, true}));
  all.push_back(make_matrix({1, 1, 256, 0.7}));
  return all;
}

TEST(Multigrid, CycleIsSymmetric) {
  for (const PoissonMatrix& a : matrices_of_all_kinds()) {
    Cycle cycle(a);
    const auto u = random_vector(a, 1), v = random_vector(a, 2);
    const auto zu = cycle.apply(u), zv = cycle.apply(v);
    const double scale = std::sqrt(cycle.dot(u, zu) * cycle.dot(v, zv));
    EXPECT_NEAR(cycle.dot(v, zu), cycle.dot(u, zv), kCycleRounding * scale);  // measured 2e-7
  }
}

// The cycle as a matrix on the unknowns, from its columns.
MatX dense_cycle(const PoissonMatrix& a, Cycle& cycle) {
  const std::vector<int> number = number_unknowns(a);
  const auto n = static_cast<Eigen::Index>(cycle.op.unknowns());
  MatX v(n, n);
  for (std::size_t c = 0; c < a.size(); ++c) {
    if (number[c] < 0) continue;
    std::vector<double> unit(a.size(), 0.0);
    unit[c] = 1.0;
    v.col(number[c]) = gather(a, cycle.apply(unit));
  }
  return 0.5 * (v + v.transpose());
}

// Positive definite, besides one zero per closed component, and close to the inverse of A: all
// other eigenvalues of V A lie in a narrow band around 1.
TEST(Multigrid, CycleIsPositiveDefiniteAndCloseToTheInverse) {
  std::vector<PoissonMatrix> all;
  all.push_back(random_matrix(9, 7, 6, 11));
  all.push_back(make_matrix({9, 8, 8, 0.6, 1.0}));
  all.push_back(make_matrix({9, 8, 7, 2.0}));
  for (const PoissonMatrix& a : all) {
    Cycle cycle(a);
    const MatX dense = dense_matrix(a);
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(dense_cycle(a, cycle));
    const auto zeros = static_cast<Eigen::Index>(cycle.closed.count());
    EXPECT_LT(eigen.eigenvalues().head(zeros).cwiseAbs().sum(),
              kCycleRounding * eigen.eigenvalues().maxCoeff());
    // The stiffest cell alone has 1 / its diagonal (a Gauss-Seidel sweep solves it nearly exactly).
    EXPECT_GT(eigen.eigenvalues()[zeros], 0.5 / dense.diagonal().maxCoeff());

    const MatX root = eigen.eigenvectors() *
                      eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
                      eigen.eigenvectors().transpose();
    const VecX band =
        Eigen::SelfAdjointEigenSolver<MatX>(root * dense * root, Eigen::EigenvaluesOnly)
            .eigenvalues();
    EXPECT_GT(band[zeros], 0.5);            // measured 0.61, 0.92, 0.93
    EXPECT_LT(band[band.size() - 1], 1.4);  // measured 1.16, 1.23, 1.04
  }
}

TEST(Multigrid, ActsAsZeroOnClosedConstantsAndReturnsZeroMean) {
  const PoissonMatrix a = make_matrix({20, 20, 20, 2.0});
  Cycle cycle(a);
  ASSERT_EQ(cycle.closed.count(), 1u);
  std::vector<double> r = random_vector(a, 1);
  const auto z = cycle.apply(r);
  EXPECT_NEAR(cycle.closed.mean(0, z.data()), 0.0, 1e-14);
  for (double& value : r) value += 100.0;
  const auto shifted = cycle.apply(r);
  for (std::size_t n = 0; n < z.size(); ++n) EXPECT_NEAR(z[n], shifted[n], 1e-5);
}

TEST(Multigrid, WithoutProjectionConstantsStayBounded) {
  const PoissonMatrix a = make_matrix({20, 20, 20, 2.0});
  Cycle cycle(a, false);
  const std::vector<double> ones(a.size(), 1.0);
  const auto z = cycle.apply(ones);
  EXPECT_GT(cycle.dot(ones, z), 0.0);
  EXPECT_LT(max_abs(cycle.op.blocks(), z.data()), 1e4);  // measured 20
}

TEST(Multigrid, ScalesExactlyWithPowersOfTwo) {
  const PoissonMatrix a = make_matrix({16, 16, 16, 0.5, 1.0});
  Cycle cycle(a);
  std::vector<double> r = random_vector(a, 1);
  const auto z = cycle.apply(r);
  for (double& value : r) value *= std::ldexp(1.0, -300);  // far below the range of fp32
  const auto small = cycle.apply(r);
  for (std::size_t n = 0; n < z.size(); ++n) ASSERT_EQ(small[n], std::ldexp(z[n], -300));
}

TEST(Multigrid, ZeroAndEmptyGiveZero) {
  const PoissonMatrix a = make_matrix({16, 16, 16, 0.5});
  Cycle cycle(a);
  EXPECT_EQ(cycle.apply(std::vector<double>(a.size(), 0.0)), std::vector<double>(a.size(), 0.0));
  const PoissonMatrix dry = make_matrix({8, 8, 8, -1.0});
  Cycle none(dry);
  EXPECT_EQ(none.multigrid.levels(), 0);
  EXPECT_EQ(none.apply(std::vector<double>(dry.size(), 0.0)), std::vector<double>(dry.size(), 0.0));
}

TEST(Multigrid, SetupLeavesNothingBehind) {
  const PoissonMatrix big = make_matrix({40, 30, 30, 0.8, 3.0}),
                      small = make_matrix({20, 24, 18, 0.5, 2.0});
  Cycle fresh(small), used(big);
  used.apply(random_vector(big, 1));
  used.op.setup(small);
  used.closed.setup(small);
  used.multigrid.setup(used.op, &used.closed);
  const auto r = random_vector(small, 2);
  EXPECT_EQ(used.apply(r), fresh.apply(r));
}

TEST(Multigrid, MemoryIsKeptFromSetupToSetup) {
  const PoissonMatrix a = make_matrix({32, 32, 32, 0.6, 2.0});
  Cycle cycle(a);
  const std::size_t bytes = cycle.multigrid.bytes();
  cycle.multigrid.setup(cycle.op, &cycle.closed);
  EXPECT_EQ(cycle.multigrid.bytes(), bytes);
  // Six floats and a byte per cell of the water's box with its ghosts, rows of 64 for 32 cells, and
  // coarser levels, whose rows are less full (1/2 more instead of 1/7): 63 bytes a cell, and what
  // is packed.
  EXPECT_LT(static_cast<double>(bytes), 1.5 * 25 * (64 * 34 * 24) * 1.2);
}

TEST(Multigrid, CycleIsBitIdenticalForAnyNumberOfThreads) {
  const int threads = omp_get_max_threads();
  for (const Tank& tank :
       {Tank{64, 64, 64, 2.0, 0.0, random_spheres(8, 64, 64, 64, 5)}, Tank{72, 60, 95, 0.7, 4.0}}) {
    const PoissonMatrix a = make_matrix(tank);
    const auto r = random_vector(a, 1);
    omp_set_num_threads(1);
    const auto one = Cycle(a).apply(r);
    for (int n : {2, 3, 5}) {
      omp_set_num_threads(n);
      EXPECT_EQ(Cycle(a).apply(r), one) << n << " threads";
    }
  }
  omp_set_num_threads(threads);
}

// Also where parents of uniform cells are not summed up, and at the last faces of odd sides.
TEST(MultigridLevel, CoarseFacesAreTheSumOfTheirChildren) {
  const Sides open = {true, true, true, true, true, true};
  const PoissonMatrix matrices[] = {
      make_matrix({65, 43, 37, 2.0, 0.0, {}, open}), make_matrix({64, 42, 36, 0.6, 2.0, {}, open}),
      random_matrix(51, 23, 19, 5, open), random_matrix(40, 1, 21, 6)};
  int checked = 0;
  for (const PoissonMatrix& matrix : matrices) {
    PoissonOperator op;
    op.setup(matrix);
    MultigridLevel levels[3];
    levels[0].load(op);
    for (int l = 1; l < 3; ++l) {
      const MultigridLevel& fine = levels[l - 1];
      levels[l].coarsen(fine);
      const MultigridLevel& coarse = levels[l];
      for (int axis = 0; axis < 3; ++axis) {
        const Vec3i more = Vec3i::Unit(axis);
        for (int k = 0; k < coarse.nz + more[2]; ++k)
          for (int j = 0; j < coarse.ny + more[1]; ++j)
            for (int i = 0; i < coarse.nx + more[0]; ++i) {
              const std::size_t at = coarse.index(i, j, k),
                                below = coarse.index(i - more[0], j - more[1], k - more[2]);
              const int kinds = coarse.kind[at] * coarse.kind[below];  // 1, 2: water, water or air
              const bool carries = kinds == 1 || kinds == 2;
              float one;
              const float w = *coarse.faces(axis, i, j, k, 1, &one);
              const float sum = carries ? sum_of_children(fine, {i, j, k}, axis) : 0.0f;
              ASSERT_NEAR(w, sum, 3e-7f * sum)  // four numbers added in another order
                  << "level " << l << " axis " << axis << ": " << i << " " << j << " " << k;
              checked += w != 0.0f;
            }
      }
    }
  }
  EXPECT_GT(checked, 10000);
}

}  // namespace
}  // namespace archetide::testing
