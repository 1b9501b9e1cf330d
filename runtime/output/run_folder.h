#pragma once

#include <string>
#include <vector>

#include "runtime/output/manifest.h"

namespace archetide {

/// The frames of a run folder; an empty path means that the frame has no such file.
struct FrameFiles {
  int number = 0;
  std::string surface, bodies, markers, spray;
};

/// A run folder as render and report find it.
struct RunFolder {
  std::string path;  // with the final '/'
  Manifest manifest;
  std::vector<FrameFiles> frames;     // ascending
  std::vector<std::string> pictures;  // ascending, PNG
};

/// Removes frame files with numbers from `first` on, which a resumed run writes again.
void remove_frames_from(const std::string& directory, int first);

/// Throws FileError when it is no run folder.
RunFolder open_run_folder(const std::string& directory);

}  // namespace archetide
