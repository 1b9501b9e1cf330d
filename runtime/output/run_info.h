#pragma once

#include <string>

#include "runtime/output/run_folder.h"

namespace archetide {

/// What `info` prints about a run, in lines.
std::string run_info_text(const RunFolder& run);
/// manifest.json, and what the folder holds: state, frames_on_disk, pictures, checkpoint, bytes.
std::string run_info_json(const RunFolder& run);

}  // namespace archetide
