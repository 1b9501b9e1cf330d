// What a step asks of the system after the first few: no pages.
#include <sys/resource.h>

#include "common/base/keep_memory.h"
#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

// Waves and two floating balls that touch now and then: everything that a step frees it finds again
// in the next.
struct NewPages {
  long first = 0, later = 0;  // of kFirst steps, of the kSteps after them
};
constexpr int kFirst = 20, kSteps = 40;
NewPages new_pages(int particles) {
  SimulationOptions o = unit_tank(32);
  o.particles_per_cell = particles;
  o.body_contact = true;
  o.tolerance = 1e-6;
  Simulation s(
      o,
      water_where(o.grid, [](const Vec3& x) { return x[2] - 0.5 - 0.02 * std::cos(M_PI * x[0]); }),
      {rigid_ball(0.1, 500.0, Vec3(0.38, 0.5, 0.5)), rigid_ball(0.1, 500.0, Vec3(0.62, 0.5, 0.5))},
      {});
  NewPages pages;
  for (int n = 0; n < kFirst + kSteps; ++n) {
    const long before = page_faults();
    s.step(0.01);
    (n < kFirst ? pages.first : pages.later) += page_faults() - before;
  }
  std::printf("%d particles a cell: %ld new pages in %d steps, %ld in the next %d\n", particles,
              pages.first, kFirst, pages.later, kSteps);
  return pages;
}

// A field of this grid has 64 pages and a step makes dozens of them; the last ones that no earlier
// step needed come at steps 15 and 16. What is left (measured 0.3 to 0.9 pages a step, none in most
// of them) are lists of the surface and of contacts that become longer than ever.
TEST(Memory, StepsAskTheSystemForNoPagesAfterTheFirstFew) {
#ifdef ARCHETIDE_SANITIZED
  GTEST_SKIP() << "the checker keeps freed memory away";
#endif
  keep_freed_memory();
  const NewPages pages = new_pages(0);
  EXPECT_GT(pages.first, 500);  // the fields: it does count
  expect_at_most("new pages a step", static_cast<double>(pages.later) / kSteps, 4.0);
}
// Every 20 steps particles are seeded again, and then there may be more of them (measured 8).
TEST(Memory, ParticlesAskForPagesWhereThereAreMoreOfThem) {
#ifdef ARCHETIDE_SANITIZED
  GTEST_SKIP() << "the checker keeps freed memory away";
#endif
  keep_freed_memory();
  const NewPages pages = new_pages(8);
  expect_at_most("new pages a step", static_cast<double>(pages.later) / kSteps, 32.0);
}

}  // namespace
}  // namespace archetide
