#include "runtime/output/svg_error_chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/base/number_text.h"
#include "runtime/output/svg_parts.h"

namespace archetide {
namespace {

using svg::Range;
constexpr double kTall = 340;  // picture units

bool drawable(const ErrorSeries& s, std::size_t n) { return s.cost[n] > 0.0 && s.error[n] > 0.0; }

// Whole powers of ten, and more between them the fewer of those there are.
std::vector<double> ticks(const Range& r) {
  std::vector<double> all, whole;
  const std::vector<double> leads =
      r.high - r.low < 0.7 ? std::vector<double>{1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0}
                           : std::vector<double>{1.0, 2.0, 5.0};
  for (int power = static_cast<int>(std::floor(r.low)); power <= r.high; ++power)
    for (const double lead : leads) {
      const double at = power + std::log10(lead);
      if (at < r.low - 1e-9 || at > r.high + 1e-9) continue;
      all.push_back(at);
      if (lead == 1.0) whole.push_back(at);
    }
  return r.high - r.low < 2.5 ? all : whole;
}

std::string tick_text(double power) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0e", std::pow(10.0, power));
  const double value = std::pow(10.0, power);
  if (power > -3.01 && power < 4.0) std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void include(Range& rx, Range& ry, const std::vector<ErrorSeries>& series) {
  for (const ErrorSeries& s : series)
    for (std::size_t n = 0; n < s.cost.size(); ++n)
      if (drawable(s, n)) rx.include({std::log10(s.cost[n])}), ry.include({std::log10(s.error[n])});
  rx.widen(), ry.widen();
  for (Range* r : {&rx, &ry}) {
    const double room = std::max(0.08 * (r->high - r->low), 0.1);
    r->low -= room, r->high += room;
  }
}

struct Point {
  double x, y;  // picture units
};

Point place(const ErrorSeries& s, std::size_t n, const Range& rx, const Range& ry) {
  return {svg::x_of(rx, std::log10(s.cost[n])), svg::y_of(ry, std::log10(s.error[n]), kTall)};
}

std::string polyline(const std::vector<Point>& points, const std::string& style) {
  std::string path;
  for (std::size_t n = 0; n < points.size(); ++n)
    path += (n ? 'L' : 'M') + fixed_text(points[n].x, 1) + ' ' + fixed_text(points[n].y, 1);
  return points.size() < 2 ? "" : "<path d=\"" + path + "\" fill=\"none\" " + style + "/>\n";
}

std::string marks(const ErrorSeries& s, const Range& rx, const Range& ry) {
  std::vector<Point> line;
  std::string svg;
  for (std::size_t n = 0; n < s.cost.size(); ++n) {
    if (!drawable(s, n)) continue;
    const Point p = place(s, n, rx, ry);
    line.push_back(p);
    svg += "<circle cx=\"" + fixed_text(p.x, 1) + "\" cy=\"" + fixed_text(p.y, 1) +
           "\" r=\"4.5\" fill=\"" + (s.on_front[n] ? s.colour : "#fff") + "\" stroke=\"" +
           s.colour + "\" stroke-width=\"1.8\"/>\n";
    const bool left = p.x > svg::kWidth - 90;
    svg +=
        svg::text_at(p.x + (left ? -8 : 8), p.y - 6,
                     left ? "class=\"tick\" text-anchor=\"end\"" : "class=\"tick\"", s.labels[n]);
  }
  return polyline(line, "stroke=\"" + s.colour + "\" stroke-width=\"1.5\"") + svg;
}

std::string front(const std::vector<ErrorSeries>& series, const Range& rx, const Range& ry) {
  std::vector<Point> points;
  for (const ErrorSeries& s : series)
    for (std::size_t n = 0; n < s.cost.size(); ++n)
      if (drawable(s, n) && s.on_front[n]) points.push_back(place(s, n, rx, ry));
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
  return polyline(points, "stroke=\"#999\" stroke-width=\"7\" stroke-opacity=\"0.25\"");
}

}  // namespace

std::string svg_error_chart(const std::string& title, const std::string& x_label,
                            const std::string& y_label, const std::vector<ErrorSeries>& series) {
  Range rx, ry;
  include(rx, ry, series);
  std::string text = "<figure class=\"chart\">" + svg::open_svg(kTall);
  text += svg::text_at(0, 14, "class=\"title\"", title);
  for (const double v : ticks(ry)) text += svg::y_tick(svg::y_of(ry, v, kTall), tick_text(v));
  for (const double v : ticks(rx)) text += svg::x_tick(svg::x_of(rx, v), tick_text(v), kTall);
  text += svg::labels(x_label, y_label, kTall) + front(series, rx, ry);
  std::vector<std::pair<std::string, std::string>> names;
  for (const ErrorSeries& s : series) {
    text += marks(s, rx, ry);
    names.emplace_back(s.name, s.colour);
  }
  return text + "</svg>" + svg::legend(names) + "</figure>\n";
}

}  // namespace archetide
