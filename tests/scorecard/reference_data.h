#pragma once

#include <string>
#include <vector>

namespace archetide {

/// Rows of numbers of tests/analytic/reference/NAME (two lines above them: origin, column names).
std::vector<std::vector<double>> reference_rows(const std::string& name);

}  // namespace archetide
