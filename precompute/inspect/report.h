#pragma once

#include <string>
#include <vector>

namespace archetide {

/// One self-contained page about the archetypes: quality of the tets, mass and inertia against the
/// surface's exact values, modes with pictures, seconds and memory. Throws FileError, MachineError.
void write_archetype_report(const std::string& path, const std::vector<std::string>& archetypes);

}  // namespace archetide
