#pragma once

#include <sys/resource.h>

namespace archetide {

/// CPU seconds of this process, all its threads, and of the processes that it started and that have
/// ended.
inline double cpu_seconds() {
  double sum = 0.0;
  for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage use{};
    getrusage(who, &use);
    for (const timeval& t : {use.ru_utime, use.ru_stime})
      sum += double(t.tv_sec) + 1e-6 * double(t.tv_usec);
  }
  return sum;
}

}  // namespace archetide
