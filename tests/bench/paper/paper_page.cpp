#include "tests/bench/paper/paper_page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include "common/base/number_text.h"
#include "common/files/html_text.h"
#include "runtime/output/report_charts.h"
#include "runtime/output/report_parts.h"

namespace archetide {
namespace {

constexpr std::size_t kPictures = 5;
constexpr int kPictureWidth = 480;        // pixels, about
constexpr double kPaperSeconds = 60.0;    // a frame: what the paper says of Fig. 6
constexpr double kVolumeBound = 1e-3;     // of all water
constexpr double kEnergyBound = 1e-3;     // of the largest energy in motion
constexpr double kOverlapBound = 0.5;     // cells
constexpr const char* kPaper = "_paper";  // ending of a run by the paper's own method

/// One figure of one run, under its heading.
struct Cell {
  std::string name, text, goal;  // goal: "" when there is none
  bool missed = false;
};

std::string state_text(const PaperRun& run) {
  const Manifest& m = run.folder.manifest;
  switch (run.state) {
    case PaperState::kNotRun:
      return "not run";
    case PaperState::kDone:
      return "done";
    case PaperState::kFailed:
      return "failed: " + run.reason.substr(0, run.reason.find('\n'));
    case PaperState::kUnfinished:
      break;
  }
  const std::vector<double>& t = run.stats.column("t");
  return "not finished: " + fixed_text(t.empty() ? 0.0 : t.back(), 2) + " of " +
         fixed_text(m.end_time, 2) + " s";
}

/// A figure with the most that it should be; NaN: no bound.
Cell bounded(const std::string& name, double value, double most,
             const std::function<std::string(double)>& text) {
  if (std::isnan(value)) return {name, "", "", false};
  return {name, text(value), std::isnan(most) ? "" : text(most), value > most};
}

std::string one_decimal(double x) { return fixed_text(x, 1); }
std::string whole(double x) { return fixed_text(x, 0); }
std::string two_decimals(double x) { return fixed_text(x, 2); }
std::string percent(double x) { return fixed_text(100.0 * x, 3) + " %"; }
// Round-off as 0.
std::string small(double x) { return x < 1e-12 ? "0" : scientific_text(x); }

/// "1 thread", "2 threads".
std::string counted(std::size_t n, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

Cell minute_over(double seconds) {
  return bounded("a minute over it", kPaperSeconds / seconds, PaperFigures::kUnknown, one_decimal);
}

/// All figures of a run, in the order of the table.
std::vector<Cell> cells_of(const PaperRun& run, bool quick) {
  const PaperFigures& f = run.figures;
  const Manifest& m = run.folder.manifest;
  const double none = PaperFigures::kUnknown;
  const bool known = !std::isnan(f.seconds);
  std::vector<Cell> cells = {
      bounded("s a frame", f.seconds, quick ? none : run.scene.goal, two_decimals),
      bounded("worst frame, s", f.worst_seconds, none, two_decimals),
      bounded("iterations", f.iterations, none, one_decimal),
      bounded("most iterations", f.worst_iterations, none, whole),
      bounded("memory", f.bytes, none, bytes_text),
      bounded("volume error", f.volume, kVolumeBound, percent),
      bounded("energy gained", f.energy, kEnergyBound, small),
      bounded("momentum error", f.unmatched, none, small),
      bounded("overlap, cells", f.overlap, kOverlapBound, two_decimals),
      bounded("deformation", f.deformation, none, two_decimals),
      {"threads", known ? std::to_string(m.threads) : "", "", false},
  };
  if (!quick) cells.insert(cells.begin() + 2, minute_over(f.seconds));
  return cells;
}

/// What the table of all runs has no room for.
std::vector<Cell> details_of(const PaperRun& run) {
  const PaperFigures& f = run.figures;
  const double none = PaperFigures::kUnknown;
  return {bounded("steps", f.steps, none, whole),
          bounded("halvings of steps", f.halvings, none, whole),
          bounded("CPU s a frame, with its files", f.cpu_seconds, none, two_decimals),
          bounded("energy regained", f.regained, none, small),
          bounded("change of all water", f.kept, none, small),
          bounded("momentum that the budget leaves over", f.rest, none, small)};
}

std::vector<Cell> all_cells(const PaperRun& run, bool quick) {
  std::vector<Cell> cells = cells_of(run, quick);
  for (Cell& cell : details_of(run)) cells.push_back(std::move(cell));
  return cells;
}

std::string wall_text(const std::vector<PaperRun>& runs) {
  double sum = 0.0;
  for (const PaperRun& run : runs) sum += run.folder.manifest.wall_seconds;
  return "In all " + duration_text(sum) + " of wall time.";
}

/// "8.4 (goal 3)" where it is missed.
std::string with_goal(const Cell& cell) {
  return cell.missed ? cell.text + " (goal " + cell.goal + ")" : cell.text;
}

std::string marked(const Cell& cell) {
  const std::string text = html_text(with_goal(cell));
  return cell.missed ? "<b class=\"miss\">" + text + "</b>" : text;
}

std::vector<std::string> headings(bool quick) {
  std::vector<std::string> names = {"figure", "run", "grid"};
  for (const Cell& cell : cells_of(PaperRun(), quick)) names.push_back(cell.name);
  names.push_back("ended");
  return names;
}

std::string overview(const std::vector<PaperRun>& runs, bool quick) {
  std::string html =
      "<div class=\"wide\"><table class=\"paper\">\n" + html_row(headings(quick), "th");
  for (const PaperRun& run : runs) {
    const Grid& grid = run.folder.manifest.grid;
    std::vector<std::string> row = {
        html_text(run.scene.figure),
        "<a href=\"#" + html_text(run.scene.name) + "\">" + html_text(run.scene.name) + "</a>",
        grid.cells() ? grid_text(grid) : ""};
    for (const Cell& cell : cells_of(run, quick)) row.push_back(marked(cell));
    row.push_back(html_text(state_text(run)));
    html += html_row(row, "td", run.state == PaperState::kFailed ? "miss" : "");
  }
  return html + "</table></div>\n<p class=\"note\">" + wall_text(runs) + "</p>\n";
}

// ---- One run --------------------------------------------------------------------------------

std::string frame_chart(const std::string& title, const std::string& unit,
                        const std::vector<std::pair<std::string, const PaperRun*>>& runs,
                        std::vector<double> FrameCosts::*values) {
  Chart chart{title, "frame", unit, {}};
  for (const auto& [name, run] : runs) {
    Series line{name, {}, {}, chart_colour(static_cast<int>(chart.series.size()))};
    for (std::size_t f = 1; f < (run->costs.*values).size(); ++f) {
      line.x.push_back(static_cast<double>(f));
      line.y.push_back((run->costs.*values)[f]);
    }
    chart.series.push_back(std::move(line));
  }
  return svg_chart(chart);
}

void add_line(Chart& chart, const std::string& name, const CsvTable& stats,
              std::vector<double> values, double factor = 1.0) {
  for (double& v : values) v *= factor;
  chart.series.push_back({name, stats.column("t"), std::move(values),
                          chart_colour(static_cast<int>(chart.series.size()))});
}

constexpr double kPercent = 100.0;

std::string volume_chart(const CsvTable& stats) {
  Chart chart = time_chart("Water: change since the first step", "%");
  add_line(chart, "that surface and drops show", stats, volume_change(stats, false), kPercent);
  add_line(chart, "all", stats, volume_change(stats, true), kPercent);
  return svg_chart(chart);
}

std::string momentum_chart(const CsvTable& stats) {
  Chart chart = time_chart("Momentum of all, and that which no force explains", "kg m/s");
  add_line(chart, "momentum", stats, norms(stats, "p"));
  add_line(chart, "unmatched", stats, norms(stats, "unmatched_p"));
  return svg_chart(chart);
}

std::string gain_chart(const CsvTable& stats) {
  Chart chart = time_chart("Energy above its start plus work: never above 0", "J");
  add_line(chart, "energy", stats, energy_gain(stats));
  return svg_chart(chart);
}

std::string overlap_chart(const PaperRun& run) {
  Chart chart = time_chart("Deepest overlap", "cells");
  add_line(chart, "overlap", run.stats, run.stats.column("max_penetration"),
           1.0 / run.folder.manifest.grid.dx);
  return svg_chart(chart);
}

std::string charts_of(const PaperRun& run) {
  const CsvTable& stats = run.stats;
  if (stats.rows() == 0) return "";
  return "<div class=\"charts\">\n" +
         frame_chart("Wall seconds of a frame", "s", {{"frame", &run}}, &FrameCosts::seconds) +
         frame_chart("Iterations of a coupled solve", "mean of the frame", {{"solve", &run}},
                     &FrameCosts::iterations) +
         volume_chart(stats) + momentum_chart(stats) + gain_chart(stats) + energy_chart(stats) +
         columns_chart(stats, "Largest deformation, share of the body's size", "1",
                       {{"max_deformation", "deformation"}}) +
         overlap_chart(run) + "</div>\n";
}

std::string film_of(const PaperRun& run) {
  if (!std::filesystem::exists(run.folder.path + "film.mp4")) return "";
  return "<video controls loop muted preload=\"metadata\" src=\"" + html_text(run.scene.name) +
         "/film.mp4\"></video>\n";
}

/// What there is to say about each run, beside its curves.
std::string figures_table(const PaperRun& run, bool quick) {
  if (std::isnan(run.figures.seconds)) return "";
  std::string html = "<table class=\"paper\">" + html_row({"figure", "value", "at most"}, "th");
  for (const Cell& cell : all_cells(run, quick))
    html += html_row({html_text(cell.name), html_text(cell.text), html_text(cell.goal)}, "td",
                     cell.missed ? "miss" : "");
  return html + "</table>\n";
}

std::string section(const PaperRun& run, bool quick) {
  const Manifest& m = run.folder.manifest;
  std::string html = "<h2 id=\"" + html_text(run.scene.name) + "\">Fig. " +
                     html_text(run.scene.figure) + ": " + html_text(run.scene.name) + "</h2>\n";
  html += "<p>" + html_text(run.scene.shows) + "</p>\n<p class=\"note\">";
  if (m.grid.cells())
    html += grid_text(m.grid) + " cells, " + counted(m.bodies.size(), "body", "bodies") + ", " +
            fixed_text(m.end_time, 2) + " s, " +
            counted(static_cast<std::size_t>(m.threads), "thread", "threads") + ", " +
            html_text(m.build) + "; ";
  html += (run.state == PaperState::kFailed ? "<b class=\"miss\">" : "<b>") +
          html_text(state_text(run)) + "</b>";
  if (!run.scene.settings.empty())
    html += "<br>beside what the scene's file says: " + html_text(run.scene.settings);
  html += "</p>\n<div class=\"strip\">" + picture_strip(run.folder, kPictures, kPictureWidth) +
          "</div>\n<div class=\"film\">" + film_of(run) + figures_table(run, quick) + "</div>\n";
  return html + charts_of(run);
}

// ---- Two methods ----------------------------------------------------------------------------

std::string height_chart(const PaperRun& ours, const PaperRun& theirs) {
  Chart chart = time_chart("Height of the first body", "m");
  for (const PaperRun* run : {&ours, &theirs}) {
    const std::vector<double>&t = run->bodies.column("t"), &body = run->bodies.column("body"),
          &z = run->bodies.column("z");
    Series line{run->scene.name, {}, {}, chart_colour(static_cast<int>(chart.series.size()))};
    for (std::size_t n = 0; n < t.size(); ++n)
      if (body[n] == 0.0) line.x.push_back(t[n]), line.y.push_back(z[n]);
    chart.series.push_back(std::move(line));
  }
  return svg_chart(chart);
}

std::string both_charts(const PaperRun& ours, const PaperRun& theirs) {
  Chart volume = time_chart("Water that surface and drops show: change since the first step", "%");
  Chart gain = time_chart("Energy above its start plus work", "J");
  Chart deformation = time_chart("Largest deformation, share of the body's size", "1");
  for (const PaperRun* run : {&ours, &theirs}) {
    const CsvTable& stats = run->stats;
    add_line(volume, run->scene.name, stats, volume_change(stats, false), kPercent);
    add_line(gain, run->scene.name, stats, energy_gain(stats));
    add_line(deformation, run->scene.name, stats, stats.column("max_deformation"));
  }
  const std::vector<std::pair<std::string, const PaperRun*>> both = {{ours.scene.name, &ours},
                                                                     {theirs.scene.name, &theirs}};
  return "<div class=\"charts\">\n" +
         frame_chart("Wall seconds of a frame", "s", both, &FrameCosts::seconds) +
         frame_chart("Iterations of a coupled solve", "mean of the frame", both,
                     &FrameCosts::iterations) +
         svg_chart(volume) + svg_chart(gain) + svg_chart(deformation) + height_chart(ours, theirs) +
         "</div>\n";
}

std::string comparison(const PaperRun& ours, const PaperRun& theirs, bool quick) {
  if (ours.stats.rows() == 0 || theirs.stats.rows() == 0) return "";
  std::string html = "<h2>The paper's method beside ours: " + html_text(ours.scene.name) +
                     "</h2>\n<p>" + html_text(theirs.scene.shows) +
                     "</p>\n<table class=\"paper\">" +
                     html_row({"figure", "ours", "the paper's"}, "th");
  const std::vector<Cell> left = all_cells(ours, quick), right = all_cells(theirs, quick);
  for (std::size_t c = 0; c < left.size(); ++c)
    html += html_row({html_text(left[c].name), marked(left[c]), marked(right[c])});
  return html + "</table>\n" + both_charts(ours, theirs);
}

std::string comparisons(const std::vector<PaperRun>& runs, bool quick) {
  std::string html;
  for (const PaperRun& ours : runs)
    for (const PaperRun& theirs : runs)
      if (theirs.scene.name == ours.scene.name + kPaper) html += comparison(ours, theirs, quick);
  return html;
}

constexpr const char* kStyle = R"(<style>
main{max-width:1500px}.wide{overflow-x:auto}
table.paper td,table.paper th{padding:4px 7px}table.paper th{white-space:normal}
table.paper td:first-child,table.paper td:last-child{white-space:normal}
b.miss{color:#c0392b}
.strip .pictures{grid-template-columns:repeat(5,1fr)}
.film{display:grid;grid-template-columns:2fr 1fr;gap:14px;margin:14px 0}
.film video{width:100%;background:#000;border-radius:6px}
.charts{grid-template-columns:repeat(4,1fr)}
@media(max-width:1100px){.film{grid-template-columns:1fr}.charts{grid-template-columns:1fr 1fr}}
</style>
)";

std::string explanation(bool quick) {
  std::string html = "<p class=\"note\">";
  if (quick)
    html +=
        "Coarse grids and short times (QUICK=1): the goals of seconds a frame do not apply.<br>";
  html +=
      "Seconds a frame are wall seconds of its steps; their goals are for two cores. The paper "
      "names about one minute a frame for its Fig. 6, and no machine" +
      std::string(quick ? "" : ": \"a minute over it\" is how often ours goes into that") +
      ".<br>Volume error: the "
      "largest change of the water that surface and drops show; at most " +
      percent(kVolumeBound) +
      ". Energy gained: above that of the start plus the work of actuators, share of the largest "
      "kinetic and elastic energy; regained: above any earlier value. Momentum error: what the "
      "water gained beyond what pressure "
      "gave it, share of the largest momentum of water and bodies. Overlap: the deepest of two "
      "bodies, or of a body and an obstacle, at most half a cell. Deformation: the largest, share "
      "of the body's size.</p>\n";
  return html;
}

}  // namespace

std::string paper_page(const std::vector<PaperRun>& runs, bool quick) {
  std::string html = kStyle + explanation(quick) + overview(runs, quick);
  for (const PaperRun& run : runs) html += section(run, quick);
  html += comparisons(runs, quick);
  return html_page("The scenes of the paper", html);
}

std::string paper_table(const std::vector<PaperRun>& runs, bool quick) {
  std::string text, rule = "|";
  const auto add = [&](const std::string& cell) {
    text += ' ';
    for (const char c : cell) text += c == '|' ? "\\|" : std::string(1, c);
    text += " |";
  };
  text = "|";
  for (const std::string& name : headings(quick)) add(name), rule += "---|";
  text += '\n' + rule + '\n';
  for (const PaperRun& run : runs) {
    text += "|";
    add(run.scene.figure), add(run.scene.name);
    add(run.folder.manifest.grid.cells() ? grid_text(run.folder.manifest.grid) : "");
    for (const Cell& cell : cells_of(run, quick))
      add(cell.missed ? "**" + with_goal(cell) + "**" : cell.text);
    add(state_text(run));
    text += '\n';
  }
  return text + '\n' + wall_text(runs) + '\n';
}

}  // namespace archetide
