#pragma once

#include <string>
#include <vector>

#include "runtime/grid/grid.h"
#include "runtime/output/bench_table.h"

namespace archetide {

/// Parts of the report that are not about one run.

/// A table of the scorecard program: what misses first, then every row.
bool is_scorecard(const TextTable& table);
std::string scorecard_section(const TextTable& table);

/// Sweeps: error against CPU seconds, and their tables.
std::string bench_section(const std::vector<BenchTable>& tables);

/// "64 × 64 × 32", or "none" without cells.
std::string grid_text(const Grid& g);

/// A whole page in the report's style; body: HTML.
std::string html_page(const std::string& title, const std::string& body);

/// A row of cells (already HTML) of a table.
std::string html_row(const std::vector<std::string>& cells, const char* tag = "td",
                     const std::string& row_class = "");

}  // namespace archetide
