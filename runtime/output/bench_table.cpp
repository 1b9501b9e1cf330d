#include "runtime/output/bench_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>

#include "common/base/input_error.h"
#include "common/base/number_text.h"

namespace archetide {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Every number of a row with its column, in the order of the file.
struct Figure {
  const char* name;
  std::function<double&(BenchRow&)> of;
};
const std::vector<Figure>& figures() {
  static const std::vector<Figure> list = {
      {"error", [](BenchRow& r) -> double& { return r.error; }},
      {"position", [](BenchRow& r) -> double& { return r.difference.position; }},
      {"rotation", [](BenchRow& r) -> double& { return r.difference.rotation; }},
      {"modal", [](BenchRow& r) -> double& { return r.difference.modal; }},
      {"momentum", [](BenchRow& r) -> double& { return r.difference.momentum; }},
      {"angular_momentum", [](BenchRow& r) -> double& { return r.difference.angular_momentum; }},
      {"volume", [](BenchRow& r) -> double& { return r.difference.volume; }},
      {"kinetic", [](BenchRow& r) -> double& { return r.difference.kinetic; }},
      {"closed_form", [](BenchRow& r) -> double& { return r.closed_form; }},
      {"cpu_seconds", [](BenchRow& r) -> double& { return r.cpu_seconds; }},
      {"wall_seconds", [](BenchRow& r) -> double& { return r.wall_seconds; }},
      {"iterations_total", [](BenchRow& r) -> double& { return r.iterations_total; }},
      {"peak_bytes", [](BenchRow& r) -> double& { return r.peak_bytes; }},
      {"order", [](BenchRow& r) -> double& { return r.order; }}};
  return list;
}

std::string short_text(double value, const char* format) {
  if (std::isnan(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width(rows.front().size(), 0);
  for (const auto& row : rows)
    for (std::size_t c = 0; c < row.size(); ++c) width[c] = std::max(width[c], row[c].size());
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c)
      line += (c ? "  " : "") + row[c] + std::string(width[c] - row[c].size(), ' ');
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

bool better_or_equal(const BenchRow& a, const BenchRow& b) {
  return a.error <= b.error && a.cpu_seconds <= b.cpu_seconds &&
         (a.error < b.error || a.cpu_seconds < b.cpu_seconds);
}

bool counts(const BenchRow& r) { return !r.failed && !r.reference && std::isfinite(r.error); }

}  // namespace

BenchRow empty_bench_row(std::vector<std::string> values) {
  BenchRow row;
  row.values = std::move(values);
  for (const Figure& figure : figures()) figure.of(row) = kNaN;
  return row;
}

void mark_pareto(std::vector<BenchRow>& rows) {
  for (BenchRow& row : rows) {
    row.pareto = counts(row);
    for (const BenchRow& other : rows)
      if (counts(other) && better_or_equal(other, row)) row.pareto = false;
  }
}

void fill_orders(std::vector<BenchRow>& rows, std::size_t axis,
                 const std::vector<double>& numbers) {
  for (std::size_t n = 0; n < rows.size(); ++n) {
    rows[n].order = kNaN;
    for (std::size_t m = n; m-- > 0;) {
      std::vector<std::string> values = rows[m].values;
      values[axis] = rows[n].values[axis];
      if (values != rows[n].values) continue;
      const double ratio = std::abs(std::log(numbers[m] / numbers[n]));
      if (counts(rows[m]) && counts(rows[n]) && std::isfinite(ratio) && ratio > 0.0 &&
          rows[n].error > 0.0)
        rows[n].order = std::log(rows[m].error / rows[n].error) / ratio;
      break;
    }
  }
}

std::string bench_text(const BenchTable& table) {
  std::vector<std::vector<std::string>> cells(1, table.keys);
  for (const char* name : {"error", "order", "CPU s", "wall s", "steps", "iterations", "most",
                           "memory", "front", "status"})
    cells[0].push_back(name);
  for (const BenchRow& r : table.rows) {
    std::vector<std::string> row = r.values;
    for (const std::string& cell :
         {short_text(r.error, "%.3g"), short_text(r.order, "%.2f"),
          short_text(r.cpu_seconds, "%.2f"), short_text(r.wall_seconds, "%.2f"),
          std::to_string(r.steps), short_text(r.iterations_total, "%.0f"),
          std::to_string(r.iterations_max),
          std::isnan(r.peak_bytes) ? std::string("-") : bytes_text(r.peak_bytes),
          std::string(r.pareto ? "*" : ""), r.reference ? "reference" : r.status})
      row.push_back(cell);
    cells.push_back(row);
  }
  return "error: " + table.measure + ", against " + table.against + "\n" + aligned(cells);
}

void write_bench_csv(const std::string& path, const BenchTable& table) {
  TextTable out;
  out.names = {"scene", "measure", "against"};
  for (const std::string& key : table.keys) out.names.push_back("key:" + key);
  for (const Figure& figure : figures()) out.names.push_back(figure.name);
  for (const char* name : {"iterations_max", "steps", "pareto", "reference", "failed", "status"})
    out.names.push_back(name);
  for (BenchRow r : table.rows) {
    std::vector<std::string> row = {table.scene, table.measure, table.against};
    row.insert(row.end(), r.values.begin(), r.values.end());
    for (const Figure& figure : figures()) row.push_back(cell_text(figure.of(r)));
    for (const int value :
         {r.iterations_max, r.steps, int(r.pareto), int(r.reference), int(r.failed)})
      row.push_back(std::to_string(value));
    row.push_back(r.status);
    out.rows.push_back(row);
  }
  write_text_csv(path, out);
}

bool is_bench_csv(const TextTable& table) {
  return table.has("measure") && table.has("cpu_seconds") && table.has("pareto");
}

BenchTable read_bench_csv(const std::string& path) {
  const TextTable in = read_text_csv(path);
  if (!is_bench_csv(in)) throw FileError(path + ": not a table of archetide-sim bench");
  BenchTable table;
  for (const std::string& name : in.names)
    if (name.starts_with("key:")) table.keys.push_back(name.substr(4));
  for (std::size_t n = 0; n < in.rows.size(); ++n) {
    table.scene = in.at(n, "scene"), table.measure = in.at(n, "measure");
    table.against = in.at(n, "against");
    BenchRow row;
    for (const std::string& key : table.keys) row.values.push_back(in.at(n, "key:" + key));
    for (const Figure& figure : figures()) figure.of(row) = in.number(n, figure.name);
    row.iterations_max = std::atoi(in.at(n, "iterations_max").c_str());
    row.steps = std::atoi(in.at(n, "steps").c_str());
    row.pareto = in.at(n, "pareto") == "1", row.reference = in.at(n, "reference") == "1";
    row.failed = in.at(n, "failed") == "1", row.status = in.at(n, "status");
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace archetide
