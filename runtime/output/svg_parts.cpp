#include "runtime/output/svg_parts.h"

#include <algorithm>
#include <cmath>

#include "common/base/number_text.h"
#include "common/files/html_text.h"

namespace archetide::svg {

void Range::include(const std::vector<double>& values) {
  for (double v : values)
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
}

void Range::widen() {
  if (!(low <= high)) low = 0.0, high = 1.0;
  const double least = 1e-12 * std::max(std::abs(low), std::abs(high)) + 1e-300;
  if (high - low < least) {
    const double half = std::max({least, 0.05 * std::abs(low), 1e-12});
    low -= half, high += half;
  }
}

double along(const Range& r, double value, double from, double to) {
  return from + (to - from) * (value - r.low) / (r.high - r.low);
}
double x_of(const Range& r, double value) { return along(r, value, kLeft, kWidth - kRight); }
double y_of(const Range& r, double value, double height) {
  return along(r, value, height - kBottom, kTop);
}

std::string open_svg(double height) {
  return "<svg viewBox=\"0 0 " + fixed_text(kWidth, 0) + ' ' + fixed_text(height, 0) +
         "\" role=\"img\">\n";
}

std::string text_at(double x, double y, const char* attributes, const std::string& text) {
  return "<text x=\"" + fixed_text(x, 1) + "\" y=\"" + fixed_text(y, 1) + "\" " + attributes + ">" +
         html_text(text) + "</text>\n";
}

std::string line_at(double x1, double y1, double x2, double y2, const char* css_class) {
  return "<line x1=\"" + fixed_text(x1, 1) + "\" y1=\"" + fixed_text(y1, 1) + "\" x2=\"" +
         fixed_text(x2, 1) + "\" y2=\"" + fixed_text(y2, 1) + "\" class=\"" + css_class + "\"/>\n";
}

std::string y_tick(double y, const std::string& text) {
  return line_at(kLeft, y, kWidth - kRight, y, "grid") +
         text_at(kLeft - 6, y + 3.5, "class=\"tick\" text-anchor=\"end\"", text);
}

std::string x_tick(double x, const std::string& text, double height) {
  return line_at(x, height - kBottom, x, height - kBottom + 4, "axis") +
         text_at(x, height - kBottom + 16, "class=\"tick\" text-anchor=\"middle\"", text);
}

std::string labels(const std::string& x_label, const std::string& y_label, double height) {
  return line_at(kLeft, height - kBottom, kWidth - kRight, height - kBottom, "axis") +
         text_at(0.5 * (kLeft + kWidth - kRight), height - 6,
                 "class=\"tick\" text-anchor=\"middle\"", x_label) +
         text_at(kLeft, kTop - 6, "class=\"tick\" text-anchor=\"start\"", y_label);
}

std::string legend(const std::vector<std::pair<std::string, std::string>>& names_and_colours) {
  if (names_and_colours.size() < 2) return "";
  std::string html = "<div class=\"legend\">";
  for (const auto& [name, colour] : names_and_colours)
    html += "<span><i style=\"background:" + colour + "\"></i>" + html_text(name) + "</span> ";
  return html + "</div>";
}

}  // namespace archetide::svg
