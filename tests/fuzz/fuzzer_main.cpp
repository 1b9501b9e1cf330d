// libFuzzer's entry: ARCHETIDE_FUZZ_TARGET says which target this program is.

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/fuzz_targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const archetide::FuzzTarget& target = *archetide::find_fuzz_target(ARCHETIDE_FUZZ_TARGET);
  target.run({reinterpret_cast<const char*>(data), size});
  return 0;
}
