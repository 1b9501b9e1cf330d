#pragma once

#include <string>

namespace archetide {

/// Bytes that this process may still take: the least of what the machine has free, what its control
/// group and its address-space limit leave, and the environment variable ARCHETIDE_MEMORY_LIMIT
/// (bytes of this process, with K, M or G behind the number) less what it uses already. Throws
/// InputError when the variable cannot be understood.
double available_memory();

/// The most that this process has used so far, bytes.
double peak_memory();

/// Throws MachineError (exit 5) when `bytes` are not available; `what` needs them, `hint` says how
/// to need less.
void demand_memory(double bytes, const std::string& what, const std::string& hint);

/// A low estimate of what meshing and modes of so many tets take, bytes: tets and matrices, the
/// vectors of `modes` modes, and the factor of a thin body (a compact one takes more; the factor's
/// own size is known only once its pattern is).
double least_memory(double tets, int order, int modes);

}  // namespace archetide
