#pragma once

#include <limits>
#include <string>
#include <vector>

namespace archetide::svg {

/// Picture units of one chart and of the field that the lines fill.
inline constexpr double kWidth = 520, kHeight = 260;
inline constexpr double kLeft = 62, kRight = 12, kTop = 34, kBottom = 40;

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(const std::vector<double>& values);
  /// Never empty and never of zero length; a value that only wobbles by round-off stays a flat
  /// line.
  void widen();
};

/// `value` of the range mapped to from..to.
double along(const Range& r, double value, double from, double to);
double x_of(const Range& r, double value);
double y_of(const Range& r, double value, double height = kHeight);

std::string open_svg(double height);
std::string text_at(double x, double y, const char* attributes, const std::string& text);
std::string line_at(double x1, double y1, double x2, double y2, const char* css_class);
/// A grid line and its number at the left; a stroke and its number at the bottom.
std::string y_tick(double y, const std::string& text);
std::string x_tick(double x, const std::string& text, double height = kHeight);
/// The axis at the bottom and both labels.
std::string labels(const std::string& x_label, const std::string& y_label, double height = kHeight);
/// Coloured strokes with names.
std::string legend(const std::vector<std::pair<std::string, std::string>>& names_and_colours);

}  // namespace archetide::svg
