#include "runtime/output/svg_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "runtime/output/number_text.h"

namespace archetide {
namespace {

// Picture units of one chart and of the field that the lines fill.
constexpr double kWidth = 520, kHeight = 260;
constexpr double kLeft = 62, kRight = 12, kTop = 34, kBottom = 40;
constexpr int kMostPoints = 500;  // per line; more would not be seen

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(const std::vector<double>& values) {
    for (double v : values)
      if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  // Never empty and never of zero length; a value that only wobbles by round-off stays a flat line.
  void widen() {
    if (!(low <= high)) low = 0.0, high = 1.0;
    const double least = 1e-12 * std::max(std::abs(low), std::abs(high)) + 1e-300;
    if (high - low < least) {
      const double half = std::max({least, 0.05 * std::abs(low), 1e-12});
      low -= half, high += half;
    }
  }
};

// Spacing of about `count` ticks: 1, 2 or 5 times a power of ten.
double tick_step(const Range& r, int count) {
  const double raw = (r.high - r.low) / count, power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  return power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
}

std::string tick_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) value = 0.0;
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

double along(const Range& r, double value, double from, double to) {
  return from + (to - from) * (value - r.low) / (r.high - r.low);
}

std::string text_at(double x, double y, const char* attributes, const std::string& text) {
  return "<text x=\"" + fixed_text(x, 1) + "\" y=\"" + fixed_text(y, 1) + "\" " + attributes + ">" +
         html_text(text) + "</text>\n";
}

std::string line_at(double x1, double y1, double x2, double y2, const char* css_class) {
  return "<line x1=\"" + fixed_text(x1, 1) + "\" y1=\"" + fixed_text(y1, 1) + "\" x2=\"" +
         fixed_text(x2, 1) + "\" y2=\"" + fixed_text(y2, 1) + "\" class=\"" + css_class + "\"/>\n";
}

std::string axes(const Chart& chart, const Range& rx, const Range& ry) {
  std::string svg;
  const double step_y = tick_step(ry, 5), step_x = tick_step(rx, 6);
  for (double v = std::ceil(ry.low / step_y) * step_y; v <= ry.high + 1e-9 * step_y; v += step_y) {
    const double y = along(ry, v, kHeight - kBottom, kTop);
    svg += line_at(kLeft, y, kWidth - kRight, y, "grid");
    svg += text_at(kLeft - 6, y + 3.5, "class=\"tick\" text-anchor=\"end\"", tick_text(v, step_y));
  }
  for (double v = std::ceil(rx.low / step_x) * step_x; v <= rx.high + 1e-9 * step_x; v += step_x) {
    const double x = along(rx, v, kLeft, kWidth - kRight);
    svg += line_at(x, kHeight - kBottom, x, kHeight - kBottom + 4, "axis");
    svg += text_at(x, kHeight - kBottom + 16, "class=\"tick\" text-anchor=\"middle\"",
                   tick_text(v, step_x));
  }
  svg += line_at(kLeft, kHeight - kBottom, kWidth - kRight, kHeight - kBottom, "axis");
  svg += text_at(0.5 * (kLeft + kWidth - kRight), kHeight - 6,
                 "class=\"tick\" text-anchor=\"middle\"", chart.x_label);
  svg += text_at(kLeft, kTop - 6, "class=\"tick\" text-anchor=\"start\"", chart.y_label);
  return svg;
}

// The points of a line, thinned to the lowest and highest of each stretch so that no peak is lost.
std::string path(const Series& s, const Range& rx, const Range& ry) {
  const std::size_t n = std::min(s.x.size(), s.y.size());
  const std::size_t stretch = std::max<std::size_t>(1, 2 * n / kMostPoints);
  std::string points;
  bool pen_down = false;
  const auto draw = [&](std::size_t i) {
    if (!std::isfinite(s.y[i])) {
      pen_down = false;
      return;
    }
    points += (pen_down ? 'L' : 'M') + fixed_text(along(rx, s.x[i], kLeft, kWidth - kRight), 1) +
              ' ' + fixed_text(along(ry, s.y[i], kHeight - kBottom, kTop), 1);
    pen_down = true;
  };
  for (std::size_t i = 0; i < n; i += stretch) {
    const auto first = s.y.begin() + i, last = s.y.begin() + std::min(n, i + stretch);
    std::size_t low = std::min_element(first, last) - s.y.begin();
    std::size_t high = std::max_element(first, last) - s.y.begin();
    if (low > high) std::swap(low, high);
    draw(low);
    if (high != low) draw(high);
  }
  return "<path d=\"" + points + "\" fill=\"none\" stroke=\"" + s.colour +
         "\" stroke-width=\"1.5\"/>\n";
}

std::string legend(const Chart& chart) {
  if (chart.series.size() < 2) return "";
  std::string html = "<div class=\"legend\">";
  for (const Series& s : chart.series)
    html += "<span><i style=\"background:" + s.colour + "\"></i>" + html_text(s.name) + "</span> ";
  return html + "</div>";
}

std::string open_svg(double height) {
  return "<svg viewBox=\"0 0 " + fixed_text(kWidth, 0) + ' ' + fixed_text(height, 0) +
         "\" role=\"img\">\n";
}

}  // namespace

std::string svg_chart(const Chart& chart) {
  Range rx, ry;
  for (const Series& s : chart.series) rx.include(s.x), ry.include(s.y);
  rx.widen(), ry.widen();
  std::string svg = "<figure class=\"chart\">" + open_svg(kHeight);
  svg += text_at(0, 14, "class=\"title\"", chart.title) + axes(chart, rx, ry);
  for (const Series& s : chart.series) svg += path(s, rx, ry);
  return svg + "</svg>" + legend(chart) + "</figure>\n";
}

std::string svg_bars(const std::string& title, const std::string& unit, std::vector<Bar> bars) {
  std::sort(bars.begin(), bars.end(), [](const Bar& a, const Bar& b) { return a.value > b.value; });
  double sum = 0.0;
  for (const Bar& b : bars) sum += b.value;
  const double row = 22, names = 150, longest = bars.empty() ? 1.0 : bars.front().value;
  std::string svg =
      "<figure class=\"chart\">" + open_svg(kTop + row * static_cast<double>(bars.size()));
  svg += text_at(0, 14, "class=\"title\"", title);
  double y = kTop - 8;
  for (const Bar& b : bars) {
    const double length = longest > 0.0 ? (kWidth - names - 120) * b.value / longest : 0.0;
    svg += text_at(names - 6, y + 14, "class=\"tick\" text-anchor=\"end\"", b.name);
    svg += "<rect x=\"" + fixed_text(names, 1) + "\" y=\"" + fixed_text(y + 3, 1) + "\" width=\"" +
           fixed_text(length, 1) + "\" height=\"14\" fill=\"" + chart_colour(0) + "\"/>\n";
    const double share = sum > 0.0 ? 100.0 * b.value / sum : 0.0;
    svg += text_at(names + length + 6, y + 14, "class=\"tick\"",
                   fixed_text(b.value, 2) + ' ' + unit + ", " + fixed_text(share, 0) + " %");
    y += row;
  }
  return svg + "</svg></figure>\n";
}

std::string chart_colour(int n) {
  static const std::array<const char*, 6> colours = {"#2b6ca3", "#d9541e", "#3a8f4d",
                                                     "#8a4fa0", "#c79a1b", "#555555"};
  return colours[n % colours.size()];
}

}  // namespace archetide
