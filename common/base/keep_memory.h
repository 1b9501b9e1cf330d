#pragma once

#include <cstdlib>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace archetide {

/// From here on memory that is freed stays with the process. Fields of a step, fronts of a factor
/// are freed and allocated again in the next; returned to the system, the system clears every page
/// of them again.
inline void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, -1);
#endif
}

}  // namespace archetide
