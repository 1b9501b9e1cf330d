#pragma once

#include <string>

#include "runtime/commands/command.h"
#include "runtime/output/checkpoint.h"

namespace archetide {

/// Where a run begins: at the start, in the middle of the run that is in the folder, or at a
/// checkpoint of another one.
struct RunStart {
  std::string checkpoint;  // "": at the start
  bool fork = false;
};

/// Decides by --resume, --replace and what the folder holds; clears a run that is to be replaced.
/// Throws InputError when the folder may not be used.
RunStart claim_run_folder(const Arguments& a, const CheckpointIdentity& identity);

}  // namespace archetide
