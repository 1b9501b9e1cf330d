#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "precompute/modal/eigen_solver.h"

extern "C" void dpotrf_(const char* triangle, const int* n, double* a, const int* lda, int* info);

namespace archetide {
namespace {

/// From here on the process may only grow by so much.
void limit_growth(rlim_t bytes) {
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most = pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE)) + bytes;
  const rlimit limit{most, most};
  ::setrlimit(RLIMIT_AS, &limit);
}

/// Ends the process: 0 when a factorisation finds its buffer although there is no room for another.
[[noreturn]] void factor_without_room() {
  ::alarm(5);
  prepare_blas();
  limit_growth(rlim_t{32} << 20);
  constexpr int n = 2;
  double unit[] = {1.0, 0.0, 0.0, 1.0};
  int info = -1;
  dpotrf_("L", &n, unit, &n, &info);
  ::_exit(info);
}

// OpenBLAS asks for ever for a buffer of 128 MiB that it cannot have. Its own thread asks for one at
// an instant of its choice and keeps all others waiting meanwhile; it is left out here, as by
// start_without_threads_if_space_is_limited() of the program.
TEST(PrepareBlas, LeavesNothingToAskForLater) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a new process: no buffer from other tests
  ::setenv("OPENBLAS_NUM_THREADS", "1", 1);
  EXPECT_EXIT(factor_without_room(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace archetide
