#pragma once

#include <functional>
#include <string>

#include "common/input_error.h"
#include "common/tet_mesh.h"

namespace archetide {

/// The work took longer than it may.
struct OutOfTime : NumericsError {
  using NumericsError::NumericsError;
};

/// Runs `work` in a child process and hands its tets back, so that a library that aborts, or never
/// ends, does not take us with it. `cpu_seconds`: what the child may use, in whole seconds; what it
/// did use is taken off. Throws OutOfTime, NumericsError with what `work` threw or with `name` and
/// the signal that ended it, MachineError when there is no process to be had.
TetMesh in_child_process(const std::string& name, double& cpu_seconds,
                         const std::function<TetMesh()>& work);

}  // namespace archetide
