#pragma once

#include <string>
#include <vector>

namespace archetide {

/// How many values fall in each of `bins` equal parts of [low, high] (those outside count in the
/// first and last), as an <svg> element.
std::string svg_histogram(const std::string& title, const std::vector<double>& values, double low,
                          double high, int bins);

}  // namespace archetide
