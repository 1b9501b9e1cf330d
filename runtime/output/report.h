#pragma once

#include <string>
#include <vector>

namespace archetide {

/// One self-contained HTML page about one or several run folders: pictures, conservation, motion of
/// the bodies, cost. Reads manifest.json, stats.csv, bodies.csv and pictures/. Throws FileError,
/// MachineError.
void write_report(const std::vector<std::string>& directories, const std::string& html_path);

}  // namespace archetide
