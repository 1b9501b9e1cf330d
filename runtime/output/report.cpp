#include "runtime/output/report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/atomic_file.h"
#include "runtime/output/csv.h"
#include "runtime/output/palette.h"
#include "runtime/output/report_charts.h"
#include "runtime/output/report_parts.h"
#include "runtime/output/run_folder.h"
#include "runtime/output/svg_chart.h"

namespace archetide {
namespace {

constexpr std::size_t kPictures = 4;    // per run
constexpr int kPictureWidth = 640;      // pixels, about
constexpr std::size_t kBodyLines = 24;  // per chart

const char* const kStyle = R"(
body{font:15px/1.5 system-ui,sans-serif;color:#222;background:#f6f7f8;margin:0}
main{max-width:1140px;margin:0 auto;padding:24px}
h1{font-size:24px;margin:0 0 4px}
h2{font-size:19px;margin:36px 0 6px;border-bottom:2px solid #2b6ca3}
p.note{color:#666;margin:2px 0 12px}
.pictures,.charts{display:grid;gap:14px;grid-template-columns:repeat(2,1fr)}
@media(max-width:760px){.pictures,.charts{grid-template-columns:1fr}}
figure{margin:0;background:#fff;border:1px solid #dde1e5;border-radius:6px;overflow:hidden}
figure.chart{padding:12px}figure img{width:100%;display:block}
figcaption{padding:4px 10px;color:#666;font-size:13px}
svg{width:100%;height:auto;display:block;font:11px system-ui,sans-serif}
.title{font-size:14px;font-weight:600;fill:#222}.tick{fill:#666}
.grid{stroke:#e6e9ec}.axis{stroke:#888}
.legend{font-size:12px;color:#444}.legend span{margin-right:12px;white-space:nowrap}
.legend i{display:inline-block;width:14px;height:3px;margin-right:5px;vertical-align:middle}
table{border-collapse:collapse;background:#fff;margin:10px 0 18px;
font-variant-numeric:tabular-nums}
td,th{border:1px solid #dde1e5;padding:4px 10px;text-align:right}
td:first-child,th:first-child{text-align:left}th{background:#eef1f4;font-weight:600}
table{font-size:13px}h3{margin:18px 0 2px;font-size:16px}
tr.miss td{background:#fdecea}tr.front td{background:#eaf4ec}
tr.about td{text-align:left;background:#f6f8fa;white-space:normal}
table.score{width:100%}table.score td:nth-child(-n+2){white-space:normal}
table.score td,table.score th{padding:4px 7px}
td{white-space:nowrap}
table.score td:nth-child(2),table.score th:nth-child(2),table.score td:nth-child(7){text-align:left}
summary{cursor:pointer;color:#2b6ca3;margin:8px 0}
i.bar{display:inline-block;height:8px;background:#3a8f4d}i.bar.over{background:#c0392b}
)";

struct Run {
  RunFolder folder;
  CsvTable stats, bodies, gauges;  // the last: empty without one
};

Run read_run(const std::string& directory) {
  Run run;
  run.folder = open_run_folder(directory);
  run.stats = read_csv(run.folder.path + "stats.csv");
  run.bodies = read_csv(run.folder.path + "bodies.csv");
  const std::string gauges = run.folder.path + "gauges.csv";
  if (std::filesystem::exists(gauges)) run.gauges = read_csv(gauges);
  return run;
}

std::string outcome(const Manifest& m) {
  if (m.exit < 0) return "still running or killed";
  if (m.exit == kExitDone) return "done";
  return fmt::format("exit {}{}", m.exit, m.reason.empty() ? "" : ": " + m.reason);
}

double worst(const std::vector<double>& values) {
  double largest = 0.0;
  for (double v : values)
    if (std::isfinite(v)) largest = std::max(largest, std::abs(v));
  return largest;
}

// A row a run: size, cost and error next to each other.
std::string overview(const std::vector<Run>& runs) {
  std::string html =
      "<table><tr><th>run</th><th>grid</th><th>bodies</th><th>time</th><th>steps</th><th>wall</th>"
      "<th>CPU</th><th>memory</th><th>iterations, worst</th><th>volume drift, worst</th>"
      "<th>residual, worst</th><th>ended</th></tr>\n";
  for (const Run& run : runs) {
    const Manifest& m = run.folder.manifest;
    html += "<tr>";
    for (const std::string& cell :
         {m.scene, grid_text(m.grid), std::to_string(m.bodies.size()), fixed_text(m.time, 3) + " s",
          std::to_string(m.steps), duration_text(m.wall_seconds), duration_text(m.cpu_seconds),
          bytes_text(m.peak_bytes), std::to_string(m.worst_iterations),
          scientific_text(m.worst_volume_drift),
          scientific_text(worst(run.stats.column("residual"))), outcome(m)})
      html += "<td>" + html_text(cell) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string body_table(const Manifest& m) {
  if (m.bodies.empty()) return "";
  std::string html =
      "<table><tr><th>body</th><th>archetype</th><th>density</th><th>mass</th><th>modes</th>"
      "<th>memory</th></tr>\n";
  for (std::size_t b = 0; b < std::min(kBodyLines, m.bodies.size()); ++b) {
    const auto& body = m.bodies[b];
    html += fmt::format(
        "<tr><td>{} {}</td><td>{}</td><td>{} kg/m³</td><td>{} kg</td><td>{}</td><td>{}</td></tr>\n",
        b, html_text(body.name), html_text(body.archetype), fixed_text(body.density, 1),
        number_text(std::round(body.mass * 1e4) / 1e4), body.modes, bytes_text(body.bytes));
  }
  html += "</table>\n";
  if (m.bodies.size() > kBodyLines)
    html += fmt::format("<p class=\"note\">and {} more</p>\n", m.bodies.size() - kBodyLines);
  return html;
}

std::string volume_chart(const CsvTable& stats) {
  Chart chart = time_chart("Water volume, change since the first step", "%");
  Series line{"volume", stats.column("t"), stats.column("water_volume"), chart_colour(0)};
  if (line.y.empty() || !(line.y.front() > 0.0)) return "";
  const double first = line.y.front();
  for (double& v : line.y) v = 100.0 * (v / first - 1.0);
  chart.series.push_back(line);
  return svg_chart(chart);
}

std::string css_colour(int body) {
  const auto& c = body_palette(body);
  char text[16];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", static_cast<int>(255 * c[0]),
                static_cast<int>(255 * c[1]), static_cast<int>(255 * c[2]));
  return text;
}

// One line a body of a column of bodies.csv, in the colours of the pictures.
std::string body_chart(const Run& run, const std::string& title, const std::string& column) {
  const std::vector<double>&t = run.bodies.column("t"), &body = run.bodies.column("body"),
        &value = run.bodies.column(column);
  std::map<int, Series> lines;
  for (std::size_t row = 0; row < std::min(t.size(), value.size()); ++row) {
    const int b = static_cast<int>(body[row]);
    if (b >= static_cast<int>(kBodyLines)) continue;
    lines[b].x.push_back(t[row]);
    lines[b].y.push_back(value[row]);
  }
  if (lines.empty()) return "";
  Chart chart = time_chart(title, "m");
  const auto& names = run.folder.manifest.bodies;
  for (auto& [b, line] : lines) {
    line.name = fmt::format(
        "{}{}", b, b < static_cast<int>(names.size()) ? " " + names[b].name : std::string());
    line.colour = css_colour(b);
    chart.series.push_back(line);
  }
  return svg_chart(chart);
}

// One line a gauge of what its columns call `what`; "" without one.
std::string gauge_chart(const Run& run, const std::string& title, const std::string& unit,
                        const std::string& what) {
  std::vector<std::pair<std::string, std::string>> lines;
  for (const std::string& name : run.gauges.names)
    if (name.ends_with(what)) lines.emplace_back(name, name.substr(0, name.size() - what.size()));
  return lines.empty() ? "" : columns_chart(run.gauges, title, unit, lines);
}

std::string phase_bars(const Manifest& m) {
  std::vector<Bar> bars;
  for (const auto& [phase, seconds] : m.phase_seconds)
    if (phase.find('/') == std::string::npos) bars.push_back({phase, seconds});
  return bars.empty() ? "" : svg_bars("Wall time by phase", "s", bars);
}

std::string section(const Run& run) {
  const Manifest& m = run.folder.manifest;
  const bool water = m.has_water;
  std::string html = fmt::format(
      "<h2>{}</h2>\n"
      "<p class=\"note\">{}<br>archetide {}, {}, {} threads, started {}, {}</p>\n",
      html_text(m.scene), html_text(m.command_line), html_text(m.version), html_text(m.build),
      m.threads, html_text(m.started), html_text(outcome(m)));
  html += picture_strip(run.folder, kPictures, kPictureWidth);
  html += body_table(m);
  html += "<div class=\"charts\">\n";
  html += body_chart(run, "Heights of the bodies", "z");
  if (water) html += volume_chart(run.stats);
  html += gauge_chart(run, "Pressure at the gauges, above that of the air", "Pa", "_p");
  html += gauge_chart(run, "Level of the water at the gauges", "m", "_level");
  html += energy_chart(run.stats);
  html += columns_chart(run.stats, "Linear momentum, water and bodies", "kg m/s",
                        {{"px", "x"}, {"py", "y"}, {"pz", "z"}});
  html += columns_chart(run.stats, "Angular momentum of the bodies about the origin", "kg m²/s",
                        {{"lx", "x"}, {"ly", "y"}, {"lz", "z"}});
  if (!m.bodies.empty())
    html += columns_chart(run.stats, "Largest deformation, share of the body's size", "1",
                          {{"max_deformation", "deformation"}});
  if (water)
    html += columns_chart(run.stats, "Iterations of the coupled solves", "per solve",
                          {{"iterations", "velocities"}, {"iterations_position", "positions"}});
  html += columns_chart(run.stats, "Step length", "s", {{"dt", "dt"}});
  html += columns_chart(run.stats, "Wall seconds of a step", "s", {{"seconds", "step"}});
  html += phase_bars(m);
  return html + "</div>\n";
}

// What the paths are: run folders, folders of bench, tables.
struct Sources {
  std::vector<Run> runs;
  std::vector<BenchTable> benches;
  std::vector<TextTable> scorecards;
};

Sources read_sources(const std::vector<std::string>& paths) {
  Sources sources;
  for (const std::string& path : paths) {
    if (std::filesystem::exists(path + "/bench.csv")) {
      sources.benches.push_back(read_bench_csv(path + "/bench.csv"));
    } else if (path.ends_with(".csv")) {
      const TextTable table = read_text_csv(path);
      if (is_scorecard(table))
        sources.scorecards.push_back(table);
      else
        sources.benches.push_back(read_bench_csv(path));
    } else {
      sources.runs.push_back(read_run(path));
    }
  }
  return sources;
}

}  // namespace

std::string grid_text(const Grid& g) {
  if (g.cells() == 0) return "none";
  return fmt::format("{} × {} × {}", g.nx, g.ny, g.nz);
}

std::string html_page(const std::string& title, const std::string& body) {
  return "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n<title>" +
         html_text(title) + "</title>\n<style>" + kStyle + "</style></head>\n<body><main>\n<h1>" +
         html_text(title) + "</h1>\n" + body + "</main></body></html>\n";
}

void write_report(const std::vector<std::string>& paths, const std::string& html_path) {
  if (paths.empty())
    throw InputError("report: name at least one run folder, bench or scorecard.csv");
  const Sources sources = read_sources(paths);
  std::string title = "archetide";
  for (std::size_t r = 0; r < sources.runs.size(); ++r)
    title += (r ? ", " : ": ") + sources.runs[r].folder.manifest.scene;
  std::string html;
  for (const TextTable& table : sources.scorecards) html += scorecard_section(table);
  html += bench_section(sources.benches);
  if (!sources.runs.empty()) html += "<h2>Runs</h2>\n" + overview(sources.runs);
  for (const Run& run : sources.runs) html += section(run);
  write_file_atomically(html_path, html_page(title, html));
}

}  // namespace archetide
