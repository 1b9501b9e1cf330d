#pragma once

#include <functional>
#include <string>

#include "common/base/input_error.h"

namespace archetide {

/// The work took longer than it may.
struct OutOfTime : NumericsError {
  using NumericsError::NumericsError;
};

/// Runs `work` in a child process and hands back the bytes that it returns, so that a library that
/// aborts, or never ends, does not take us with it. `cpu_seconds`: what the child may use, in whole
/// seconds, at least one; what it did use is taken off. Throws OutOfTime; what `work` threw
/// (SurfaceDefects, InputError, FileError, MachineError, anything else as NumericsError);
/// NumericsError with `name` and the signal that ended it; MachineError when there is no process to
/// be had. The child ends when we do.
std::string in_child_process(const std::string& name, double& cpu_seconds,
                             const std::function<std::string()>& work);

}  // namespace archetide
