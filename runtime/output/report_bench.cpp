#include <cmath>
#include <map>

#include "common/base/number_text.h"
#include "common/files/html_text.h"
#include "runtime/output/report_parts.h"
#include "runtime/output/svg_chart.h"
#include "runtime/output/svg_error_chart.h"

namespace archetide {
namespace {

std::string short_number(double value, const char* format) {
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// The key along a line: the one with most values; the others name the lines.
std::size_t line_axis(const BenchTable& t) {
  std::size_t best = 0, most = 0;
  for (std::size_t k = 0; k < t.keys.size(); ++k) {
    std::map<std::string, int> values;
    for (const BenchRow& row : t.rows) ++values[row.values[k]];
    if (values.size() > most) most = values.size(), best = k;
  }
  return best;
}

std::vector<ErrorSeries> lines_of(const BenchTable& t) {
  const std::size_t axis = line_axis(t);
  std::vector<ErrorSeries> lines;
  std::map<std::string, std::size_t> index;
  for (const BenchRow& row : t.rows) {
    if (row.reference || row.failed) continue;
    std::string name;
    for (std::size_t k = 0; k < t.keys.size(); ++k)
      if (k != axis) name += (name.empty() ? "" : ", ") + t.keys[k] + " = " + row.values[k];
    if (!index.count(name)) {
      index[name] = lines.size();
      lines.push_back({name, chart_colour(static_cast<int>(lines.size())), {}, {}, {}, {}});
    }
    ErrorSeries& line = lines[index[name]];
    line.cost.push_back(row.cpu_seconds), line.error.push_back(row.error);
    line.labels.push_back(row.values[axis]), line.on_front.push_back(row.pareto);
  }
  return lines;
}

std::string table_of(const BenchTable& t) {
  std::vector<std::string> head;
  for (const std::string& key : t.keys) head.push_back(html_text(key));
  for (const char* name : {"error", "order", "CPU s", "steps", "iterations", "most", "memory",
                           "position", "kinetic", "volume", ""})
    head.push_back(name);
  std::string html = "<table>" + html_row(head, "th");
  for (const BenchRow& r : t.rows) {
    std::vector<std::string> cells;
    for (const std::string& value : r.values) cells.push_back(html_text(value));
    const std::string state = r.reference ? "reference" : r.pareto ? "on the front" : r.status;
    for (const std::string& cell :
         {short_number(r.error, "%.3g"), short_number(r.order, "%.2f"),
          short_number(r.cpu_seconds, "%.2f"), std::to_string(r.steps),
          short_number(r.iterations_total, "%.0f"), std::to_string(r.iterations_max),
          std::isnan(r.peak_bytes) ? std::string() : bytes_text(r.peak_bytes),
          short_number(r.difference.position, "%.2g"), short_number(r.difference.kinetic, "%.2g"),
          short_number(r.difference.volume, "%.2g"), html_text(state)})
      cells.push_back(cell);
    html += html_row(cells, "td", r.failed ? "miss" : r.pareto ? "front" : "");
  }
  return html + "</table>\n";
}

// Points without any error have no place on a scale of powers of ten.
std::string chart_of(const std::string& title, const BenchTable& t) {
  const std::vector<ErrorSeries> lines = lines_of(t);
  for (const ErrorSeries& line : lines)
    for (const double error : line.error)
      if (error > 0.0) return svg_error_chart(title, "CPU seconds", "error", lines);
  return "<figure class=\"chart\"><b>" + html_text(title) +
         "</b><p class=\"note\">No point differs from the reference: see the table.</p></figure>\n";
}

}  // namespace

std::string bench_section(const std::vector<BenchTable>& tables) {
  if (tables.empty()) return "";
  std::string charts, details;
  for (const BenchTable& t : tables) {
    std::string keys;
    for (const std::string& key : t.keys) keys += (keys.empty() ? "" : ", ") + key;
    const std::string title = t.scene + ": " + keys;
    const std::string axis = t.keys.empty() ? "" : t.keys[line_axis(t)];
    charts += "<div>" + chart_of(title, t) + "<p class=\"note\">Error: " + html_text(t.measure) +
              ", against " + html_text(t.against) + ". Beside the points: " + html_text(axis) +
              ".</p></div>\n";
    details +=
        "<details><summary>" + html_text(title) + "</summary>\n" + table_of(t) + "</details>\n";
  }
  return "<h2>Speed against error</h2>\n<p class=\"note\">Every point is a run. Full points lie on "
         "the front: no other one is both cheaper and better.</p>\n<div class=\"charts\">\n" +
         charts + "</div>\n" + details;
}

}  // namespace archetide
