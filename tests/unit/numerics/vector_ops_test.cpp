#include "runtime/numerics/vector_ops.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <limits>
#include <random>

namespace archetide::testing {
namespace {

constexpr std::size_t kEntries = 300000;  // enough to be worked on in parallel

std::vector<double> random_values(unsigned seed, std::size_t n = kEntries) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> v(n);
  for (double& x : v) x = unit(random);
  return v;
}

TEST(VectorOps, SumsAgreeWithExtendedPrecision) {
  const auto a = random_values(1), b = random_values(2), c = random_values(3);
  long double ab = 0.0L, ac = 0.0L;
  for (std::size_t i = 0; i < kEntries; ++i) {
    ab += static_cast<long double>(a[i]) * b[i];
    ac += static_cast<long double>(a[i]) * c[i];
  }
  const Blocks all = all_blocks(kEntries);
  // eps * sqrt(n) * |terms|: 2e-16 * 550; measured 1e-13
  const double tolerance = 2e-12;
  EXPECT_NEAR(dot(all, a.data(), b.data()), static_cast<double>(ab), tolerance);
  const TwoSums two = dot_two(all, a.data(), b.data(), c.data());
  EXPECT_NEAR(two.first, static_cast<double>(ab), tolerance);
  EXPECT_NEAR(two.second, static_cast<double>(ac), tolerance);
}

TEST(VectorOps, StepIsTwoAxpysAndANorm) {
  const Blocks all = all_blocks(kEntries);
  const auto p = random_values(1), q = random_values(2);
  auto x = random_values(3), r = random_values(4);
  auto x_plain = x, r_plain = r;
  const double rr = step_and_dot(all, 0.3, p.data(), q.data(), x.data(), r.data());
  axpy(all, 0.3, p.data(), x_plain.data());
  axpy(all, -0.3, q.data(), r_plain.data());
  for (std::size_t i = 0; i < kEntries; ++i) {
    ASSERT_NEAR(x[i], x_plain[i], 1e-15);  // one rounding, fused or not
    ASSERT_NEAR(r[i], r_plain[i], 1e-15);
  }
  EXPECT_NEAR(rr, dot(all, r.data(), r.data()), 1e-10 * rr);
}

TEST(VectorOps, SumsDoNotDependOnTheNumberOfThreads) {
  const Blocks all = all_blocks(kEntries);
  const auto a = random_values(1), b = random_values(2);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const double one = dot(all, a.data(), b.data());
  for (int n = 2; n <= 5; ++n) {
    omp_set_num_threads(n);
    EXPECT_EQ(dot(all, a.data(), b.data()), one);
  }
  omp_set_num_threads(threads);
}

TEST(VectorOps, OnlyBlocksAreTouched) {
  Blocks blocks;
  blocks.add(2, 4);
  blocks.add(6, 6);
  blocks.add(7, 9);
  std::vector<double> y(10, 1.0);
  const std::vector<double> x(10, 1.0);
  axpy(blocks, 2.0, x.data(), y.data());
  EXPECT_EQ(y, (std::vector<double>{1, 1, 3, 3, 1, 1, 1, 3, 3, 1}));
  EXPECT_EQ(blocks.entries, 4u);
  EXPECT_EQ(sum(blocks, y.data()), 12.0);
}

TEST(VectorOps, MaxAbsShowsNotANumber) {
  auto a = random_values(1);
  a[12345] = -7.0;
  const Blocks all = all_blocks(kEntries);
  EXPECT_EQ(max_abs(all, a.data()), 7.0);
  a[200000] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(max_abs(all, a.data())));
}

}  // namespace
}  // namespace archetide::testing
