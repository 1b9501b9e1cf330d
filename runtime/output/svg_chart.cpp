#include "runtime/output/svg_chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "common/base/number_text.h"
#include "runtime/output/svg_parts.h"

namespace archetide {
namespace {

using namespace svg;
constexpr int kMostPoints = 500;  // per line; more would not be seen

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

std::string axes(const Chart& chart, const Range& rx, const Range& ry) {
  std::string svg;
  const double step_y = tick_step(ry, 5), step_x = tick_step(rx, 6);
  for (double v = std::ceil(ry.low / step_y) * step_y; v <= ry.high + 1e-9 * step_y; v += step_y)
    svg += y_tick(y_of(ry, v), tick_text(v, step_y));
  for (double v = std::ceil(rx.low / step_x) * step_x; v <= rx.high + 1e-9 * step_x; v += step_x)
    svg += x_tick(x_of(rx, v), tick_text(v, step_x));
  return svg + labels(chart.x_label, chart.y_label);
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
    points += (pen_down ? 'L' : 'M') + fixed_text(x_of(rx, s.x[i]), 1) + ' ' +
              fixed_text(y_of(ry, s.y[i]), 1);
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

std::string legend_of(const Chart& chart) {
  std::vector<std::pair<std::string, std::string>> names;
  for (const Series& s : chart.series) names.emplace_back(s.name, s.colour);
  return legend(names);
}

}  // namespace

std::string svg_chart(const Chart& chart) {
  Range rx, ry;
  for (const Series& s : chart.series) rx.include(s.x), ry.include(s.y);
  rx.widen(), ry.widen();
  std::string svg = "<figure class=\"chart\">" + open_svg(kHeight);
  svg += text_at(0, 14, "class=\"title\"", chart.title) + axes(chart, rx, ry);
  for (const Series& s : chart.series) svg += path(s, rx, ry);
  return svg + "</svg>" + legend_of(chart) + "</figure>\n";
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
