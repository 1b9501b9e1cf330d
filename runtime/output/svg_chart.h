#pragma once

#include <string>
#include <vector>

#include "common/files/html_text.h"

namespace archetide {

/// A line of a chart; NaN interrupts it.
struct Series {
  std::string name;
  std::vector<double> x, y;
  std::string colour;  // CSS
};

struct Chart {
  std::string title, x_label, y_label;
  std::vector<Series> series;
};

/// The chart as an <svg> element with axes, round ticks and a legend.
std::string svg_chart(const Chart& chart);

/// Horizontal bars, longest first, each with its share of the sum.
struct Bar {
  std::string name;
  double value = 0.0;
};
std::string svg_bars(const std::string& title, const std::string& unit, std::vector<Bar> bars);

/// The colour of line number n of a chart, CSS.
std::string chart_colour(int n);

}  // namespace archetide
