#include "runtime/numerics/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

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

}  // namespace
}  // namespace archetide
