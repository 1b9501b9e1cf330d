#pragma once

#include <string>
#include <vector>

#include "runtime/output/csv.h"

namespace archetide {

/// What a run cost, frame by frame; frame 0 is the start and costs nothing.
struct FrameCosts {
  std::vector<double> seconds;     // wall, of all steps of the frame
  std::vector<double> iterations;  // of a coupled solve, mean over steps and both solves
};

/// The column called `name`; throws FileError when there is none.
const std::vector<double>& column_of(const CsvTable& table, const std::string& name);

/// stats: stats.csv; times: of the frames, s, ascending.
FrameCosts frame_costs(const CsvTable& stats, const std::vector<double>& times);

}  // namespace archetide
