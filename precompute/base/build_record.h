#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "common/base/types.h"

namespace archetide {

/// What is known about the making of an archetype and differs from run to run or is not needed to
/// run it. It stands in a file of its own, OUT.build.json beside OUT.h5, so that building again
/// gives the same archetype byte for byte.
struct BuildRecord {
  std::string hash;                                     // content hash of the archetype
  std::vector<std::pair<std::string, double>> seconds;  // of each phase
  std::vector<std::pair<std::string, double>> memory;  // peak so far at the end of each step, bytes
  std::vector<std::string> notes;                      // what intake changed
  // Static deflections under loads on patches with the first 1, 2, ... modes against those of all
  // nodes: largest difference over largest displacement, in the mean.
  std::vector<double> patch_error_of_modes;
  // The accepted surface, exact by the divergence theorem, at density 1; volume 0: there was none.
  double surface_volume = 0.0, surface_area = 0.0;  // m^3, m^2
  Vec3 surface_centroid = Vec3::Zero();             // m, in the coordinates of the input mesh
  Mat3 surface_inertia = Mat3::Zero();              // about the centroid, m^5

  void take_seconds(const Profile& profile);
};

/// "out/duck.h5" -> "out/duck" + ending
std::string beside(const std::string& output, const std::string& ending);

/// Writes the record beside the archetype. Throws MachineError.
void write_record(const std::string& archetype_path, const BuildRecord& record);

/// The record beside an archetype, if there is one for this very content.
std::optional<BuildRecord> read_record(const std::string& archetype_path, const std::string& hash);

}  // namespace archetide
