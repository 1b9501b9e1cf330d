// As body files say it; apart from the repair itself, whose libraries a reader does not need.

#include "precompute/intake/repair.h"

namespace archetide {

const char* name_of(Repair kind) {
  constexpr const char* kNames[] = {"none", "fill", "union", "wrap"};
  return kNames[static_cast<int>(kind)];
}

}  // namespace archetide
