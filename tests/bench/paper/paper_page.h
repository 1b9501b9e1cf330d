#pragma once

#include <string>
#include <vector>

#include "tests/bench/paper/paper_run.h"

namespace archetide {

/// `quick`: the grids are coarse, so that the goals of seconds a frame mean nothing.

/// The index page, beside the run folders: films by their path, everything else in it.
std::string paper_page(const std::vector<PaperRun>& runs, bool quick);

/// The table of all runs in Markdown.
std::string paper_table(const std::vector<PaperRun>& runs, bool quick);

}  // namespace archetide
