#pragma once

#include <string>
#include <vector>

namespace archetide {

/// One self-contained HTML page about run folders (pictures, conservation, motion of the bodies,
/// cost), folders and tables of bench (error against CPU seconds) and scorecards. Reads
/// manifest.json, stats.csv, bodies.csv and pictures/ of runs, bench.csv of sweeps, and the tables
/// themselves. Throws FileError, InputError, MachineError.
void write_report(const std::vector<std::string>& paths, const std::string& html_path);

}  // namespace archetide
