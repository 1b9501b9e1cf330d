#pragma once

#include <string>
#include <utility>
#include <vector>

#include "runtime/output/csv.h"
#include "runtime/output/run_folder.h"
#include "runtime/output/svg_chart.h"

namespace archetide {

/// What pages show of one run.

/// So many pictures at even distances over the film, as <figure>s beside each other, each about so
/// many pixels wide; "" when the run has none.
std::string picture_strip(const RunFolder& run, std::size_t count, int width);

/// An empty chart over time.
Chart time_chart(const std::string& title, const std::string& y_label);

/// Columns of a table over its column t, each with its name; those that the table lacks are left out.
std::string columns_chart(const CsvTable& table, const std::string& title, const std::string& unit,
                          const std::vector<std::pair<std::string, std::string>>& columns);

/// All energies, J.
std::string energy_chart(const CsvTable& stats);

}  // namespace archetide
