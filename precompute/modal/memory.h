#pragma once

#include "common/base/memory.h"

namespace archetide {

/// A low estimate of what meshing and modes of so many tets take, bytes: tets and matrices, the
/// vectors of `modes` modes, and the factor of a thin body (a compact one takes more; the factor's
/// own size is known only once its pattern is).
double least_memory(double tets, int order, int modes);

}  // namespace archetide
