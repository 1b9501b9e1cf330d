#pragma once

#include <functional>
#include <string>

#include "common/tet_mesh.h"

namespace archetide {

/// Runs `work` in a child process and hands its tets back, so that a library that aborts does not
/// take us with it. Throws NumericsError with
/// what `work` threw, or with `name` and the signal that ended it; MachineError when there is no
/// process to be had.
TetMesh in_child_process(const std::string& name, const std::function<TetMesh()>& work);

}  // namespace archetide
