#pragma once

#include <string_view>
#include <vector>

namespace archetide {

/// One kind of input, read from any bytes at all.
struct FuzzTarget {
  const char* name;  // of the program fuzz_NAME and of its folder of inputs, corpus/NAME
  /// Returns when the bytes were read, or refused as they should be; anything else that is thrown,
  /// or a crash, is a finding.
  void (*run)(std::string_view bytes);
};

/// Scene and body files, and meshes in each format.
const std::vector<FuzzTarget>& text_targets();
/// Archetypes, skins and checkpoints: as bytes, and as fields changed behind a hash that fits.
const std::vector<FuzzTarget>& stored_targets();

/// The one with this name; null when there is none.
const FuzzTarget* find_fuzz_target(std::string_view name);

}  // namespace archetide
