#pragma once

#include <string>

namespace archetide {

/// Bytes that this process may still take: the least of what the machine has free, what its control
/// group and its address-space limit leave, and the environment variable ARCHETIDE_MEMORY_LIMIT
/// (bytes of this process, with K, M or G behind the number) less what it uses already. Throws
/// InputError when the variable cannot be understood.
double available_memory();

/// Bytes that the memory control groups of a process leave to it, versions 1 and 2; infinity where
/// none has a limit. `groups_file` lists the groups of the process, as /proc/self/cgroup does, and
/// `root` is where they are mounted.
double free_in_control_groups(const std::string& groups_file, const std::string& root);

/// The most that this process has used so far, bytes.
double peak_memory();

/// Throws MachineError (exit 5) when `bytes` are not available; `what` needs them, `hint` says how
/// to need less.
void demand_memory(double bytes, const std::string& what, const std::string& hint);

}  // namespace archetide
