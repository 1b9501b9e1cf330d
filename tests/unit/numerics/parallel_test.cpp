#include "runtime/numerics/parallel.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>

namespace archetide {
namespace {

// Even limits, no slab narrower than asked, and none with more work than a fair share but for two
// planes, where width allows.
TEST(SlabLimits, ShareTheWork) {
  struct Case {
    int planes, slabs, narrowest, wet;  // the planes from `wet` on hold nothing
  };
  for (const Case& c : {Case{64, 2, 14, 64}, Case{64, 2, 14, 40}, Case{97, 3, 6, 71},
                        Case{128, 4, 6, 50}, Case{30, 2, 14, 30}, Case{29, 2, 14, 3}}) {
    const auto work = [&](int k) -> std::size_t { return k < c.wet ? 100 + k % 7 : 0; };
    const std::vector<int> limits = slab_limits(c.planes, c.slabs, c.narrowest, work);
    ASSERT_EQ(limits.size(), static_cast<std::size_t>(c.slabs) + 1);
    EXPECT_EQ(limits.front(), 0);
    EXPECT_EQ(limits.back(), c.planes);
    double total = 0.0;
    for (int k = 0; k < c.planes; ++k) total += static_cast<double>(work(k));
    for (int s = 0; s < c.slabs; ++s) {
      EXPECT_GE(limits[s + 1] - limits[s], c.narrowest);
      EXPECT_TRUE(s == 0 || limits[s] % 2 == 0);
      double share = 0.0;
      for (int k = limits[s]; k < limits[s + 1]; ++k) share += static_cast<double>(work(k));
      EXPECT_TRUE(limits[s + 1] - limits[s] == c.narrowest || share <= total / c.slabs + 2 * 106.0)
          << c.planes << " planes, slab " << s;
    }
  }
}

// What one piece of the work throws reaches the caller, whichever thread met it; the program goes
// on.
TEST(ForEach, ExceptionsReachTheCaller) {
  omp_set_num_threads(4);
  const auto fails_at = [](int bad) {
    return [bad](auto i) {
      if (static_cast<int>(i) == bad) throw std::length_error(fmt::format("piece {}", bad));
    };
  };
  for (const int bad : {0, 17, 99}) {
    EXPECT_THROW(for_each_index(100, true, fails_at(bad)), std::length_error) << bad;
    EXPECT_THROW(for_each_index(100, false, fails_at(bad)), std::length_error) << bad;
    EXPECT_THROW(for_each_large(100, fails_at(bad)), std::length_error) << bad;
  }
  EXPECT_NO_THROW(for_each_index(100, true, fails_at(100)));
}

TEST(ForEach, TheFirstOfManyExceptionsReachesTheCallerWhole) {
  omp_set_num_threads(4);
  try {
    for_each_index(1000, true, [](int) { throw std::bad_alloc(); });
    FAIL();
  } catch (const std::bad_alloc&) {
  }
  int done = 0;  // and the next loop is none the worse
  for_each_index(10, false, [&](int) { ++done; });
  EXPECT_EQ(done, 10);
}

}  // namespace
}  // namespace archetide
