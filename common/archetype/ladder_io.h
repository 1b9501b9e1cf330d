#pragma once

#include <fmt/core.h>

#include <string>
#include <vector>

#include "common/archetype/field_io.h"
#include "common/archetype/surface_rung.h"
#include "common/base/sha256.h"
#include "common/files/hdf5_file.h"

namespace archetide::fields {

inline std::string ladder_group(std::size_t rung) { return fmt::format("ladder/{}", rung + 1); }

/// Groups ladder/1, ladder/2, .. with rung_fields(io, rung). Returns the hash of all, also an
/// attribute of the file; empty where there are no rungs.
template <class Rung, class Fields>
std::string write_ladder(Hdf5Writer& file, const std::vector<Rung>& ladder,
                         const Fields& rung_fields) {
  if (ladder.empty()) return "";
  std::string hashes;
  for (std::size_t n = 0; n < ladder.size(); ++n) {
    FieldWriter io{file, ladder_group(n)};
    rung_fields(io, ladder[n]);
    hashes += io.hash.hex();
  }
  const std::string hash = sha256_hex(hashes);
  file.attribute("ladder_version", SurfaceRung::kVersion);
  file.attribute("ladder_rungs", static_cast<int>(ladder.size()));
  file.attribute("ladder_hash", hash);
  return hash;
}

/// What write_ladder() wrote, and its hash. Throws FileError: another version, damaged.
template <class Rung, class Fields>
std::string read_ladder(const Hdf5Reader& file, std::vector<Rung>& ladder,
                        const Fields& rung_fields) {
  if (!file.has_attribute("ladder_version")) return "";
  const int version = file.int_attribute("ladder_version"),
            rungs = file.int_attribute("ladder_rungs");
  if (version != SurfaceRung::kVersion)
    file.fail(fmt::format("a ladder of surfaces of version {}, this program reads version {}",
                          version, SurfaceRung::kVersion));
  std::string hashes;
  for (int n = 0; n < rungs; ++n) {
    FieldReader io{file, ladder_group(static_cast<std::size_t>(n))};
    rung_fields(io, ladder.emplace_back());
    hashes += io.hash.hex();
  }
  const std::string hash = sha256_hex(hashes);
  if (file.text_attribute("ladder_hash") != hash)
    file.fail("the contents do not match their ladder_hash (damaged or changed by hand)");
  return hash;
}

}  // namespace archetide::fields
