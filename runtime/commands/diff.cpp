// Compares the tables of two runs.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "runtime/commands/command.h"
#include "runtime/output/csv.h"

namespace archetide {
namespace {

bool same_rows(const std::string& file, const CsvTable& a, const CsvTable& b) {
  const std::size_t rows_a = a.columns.empty() ? 0 : a.columns[0].size();
  const std::size_t rows_b = b.columns.empty() ? 0 : b.columns[0].size();
  if (rows_a == rows_b && a.names == b.names) return true;
  std::cout << file << ": " << rows_a << " rows of " << a.names.size() << " columns against "
            << rows_b << " rows of " << b.names.size() << '\n';
  return false;
}

// |a - b| <= tolerance * largest magnitude in the column; wall clocks are not compared.
bool same_column(const std::string& file, const std::string& name, const std::vector<double>& a,
                 const std::vector<double>& b, double tolerance) {
  double scale = 0.0, worst = 0.0;
  std::size_t worst_row = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    if (std::isnan(a[n]) && std::isnan(b[n])) continue;
    scale = std::max({scale, std::abs(a[n]), std::abs(b[n])});
    const double difference = std::abs(a[n] - b[n]);
    if (!(difference <= worst)) worst = difference, worst_row = n;
  }
  if (worst <= tolerance * scale) return true;
  std::cout << file << ": " << name << " differs by " << worst << " (" << worst / scale
            << " of its largest value), row " << worst_row + 2 << '\n';
  return false;
}

bool same_table(const std::string& file, const Arguments& a) {
  const CsvTable first = read_csv(a.directory + "/" + file);
  const CsvTable second = read_csv(a.other_directory + "/" + file);
  if (!same_rows(file, first, second)) return false;
  bool same = true;
  for (std::size_t c = 0; c < first.names.size(); ++c) {
    if (first.names[c].find("seconds") != std::string::npos) continue;
    same =
        same_column(file, first.names[c], first.columns[c], second.columns[c], a.tolerance) && same;
  }
  return same;
}

int diff(const Arguments& a) {
  bool same = same_table("stats.csv", a);
  same = same_table("bodies.csv", a) && same;
  const auto has_gauges = [](const std::string& folder) {
    return std::filesystem::exists(folder + "/gauges.csv");
  };
  if (has_gauges(a.directory) && has_gauges(a.other_directory))
    same = same_table("gauges.csv", a) && same;
  if (same) std::cout << "the same within " << a.tolerance << '\n';
  return same ? kExitDone : kExitNumerics;
}

}  // namespace

SimCommand diff_command() {
  return {
      "diff",
      "compare states and statistics of two runs",
      {"diff out/runs/tub out/runs/tub_resumed", "diff out/runs/tub out/runs/other --tol 1e-6"},
      diff,
      [](CLI::App& app, Arguments& a) {
        app.add_option("dir_a", a.directory, "run folder")->required()->type_name("DIR_A");
        app.add_option("dir_b", a.other_directory, "run folder")->required()->type_name("DIR_B");
        app.add_option("--tol", a.tolerance,
                       "allowed difference relative to a column's largest value")
            ->check(non_negative_number())
            ->type_name("T")
            ->capture_default_str();
      }};
}

}  // namespace archetide
