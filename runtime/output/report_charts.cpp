#include "runtime/output/report_charts.h"

#include <fmt/core.h>

#include <algorithm>

#include "common/base/number_text.h"
#include "common/files/base64.h"
#include "common/files/image.h"

namespace archetide {
namespace {

void add_column(Chart& chart, const CsvTable& table, const std::string& column,
                const std::string& name) {
  if (!table.has(column)) return;
  chart.series.push_back({name, table.column("t"), table.column(column),
                          chart_colour(static_cast<int>(chart.series.size()))});
}

}  // namespace

std::string picture_strip(const RunFolder& run, std::size_t most, int width) {
  if (run.pictures.empty() || !png_available()) return "";
  const std::size_t count = std::min(most, run.pictures.size());
  std::string html = "<div class=\"pictures\">\n";
  for (std::size_t p = 0; p < count; ++p) {
    const std::size_t index = count == 1 ? 0 : p * (run.pictures.size() - 1) / (count - 1);
    const std::string& path = run.pictures[index];
    const Image image = read_png(path);
    const int factor = (image.width + width - 1) / width;
    const int number = std::stoi(path.substr(path.size() - 10, 6));
    html += fmt::format(
        "<figure><img alt=\"frame {}\" src=\"data:image/png;base64,{}\">"
        "<figcaption>t = {} s</figcaption></figure>\n",
        number, base64(png_bytes(shrunk(image, factor))), fixed_text(number / run.manifest.fps, 2));
  }
  return html + "</div>\n";
}

Chart time_chart(const std::string& title, const std::string& y_label) {
  return {title, "time, s", y_label, {}};
}

std::string columns_chart(const CsvTable& table, const std::string& title, const std::string& unit,
                          const std::vector<std::pair<std::string, std::string>>& columns) {
  Chart chart = time_chart(title, unit);
  for (const auto& [column, name] : columns) add_column(chart, table, column, name);
  return svg_chart(chart);
}

std::string energy_chart(const CsvTable& stats) {
  Chart chart = time_chart("Energy (potential and total: change since the first step)", "J");
  add_column(chart, stats, "energy", "total");
  add_column(chart, stats, "water_kinetic", "water, kinetic");
  add_column(chart, stats, "body_kinetic", "bodies, kinetic");
  add_column(chart, stats, "body_elastic", "bodies, elastic");
  add_column(chart, stats, "potential", "potential");
  for (Series& s : chart.series)
    if ((s.name == "total" || s.name == "potential") && !s.y.empty()) {
      const double first = s.y.front();
      for (double& v : s.y) v -= first;
    }
  return svg_chart(chart);
}

}  // namespace archetide
