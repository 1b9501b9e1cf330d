#pragma once

#include <string>
#include <vector>

#include "common/files/text_csv.h"
#include "runtime/output/run_difference.h"

namespace archetide {

/// One run of a sweep: what it cost and how far it is from the reference. NaN: not known.
struct BenchRow {
  std::vector<std::string> values;  // one per swept key
  bool reference = false;           // the others are compared with it
  bool failed = false;
  std::string status = "done";  // or why it failed
  double error = 0.0;           // the one in the headline
  RunDifference difference;
  double closed_form = 0.0;  // largest distance from a closed form of [expect] / body size
  double cpu_seconds = 0.0, wall_seconds = 0.0, peak_bytes = 0.0;
  int iterations_max = 0, steps = 0;
  double iterations_total = 0.0;
  double order = 0.0;   // of convergence from the point before, same other values
  bool pareto = false;  // no other point is both cheaper and better
};

struct BenchTable {
  std::string scene;
  std::vector<std::string> keys;  // swept, the first varying slowest
  std::string measure;            // what `error` is
  std::string against;            // what the reference is
  std::vector<BenchRow> rows;
};

/// A row without figures.
BenchRow empty_bench_row(std::vector<std::string> values);

/// Marks the rows of which no other one has both less error and fewer CPU seconds.
void mark_pareto(std::vector<BenchRow>& rows);

/// Order between rows that follow each other and differ in key `axis` alone, whose values as
/// numbers are `numbers`: log(e1 / e2) / |log(h1 / h2)|, positive where the error falls.
void fill_orders(std::vector<BenchRow>& rows, std::size_t axis, const std::vector<double>& numbers);

/// Aligned columns for people.
std::string bench_text(const BenchTable& table);

/// The CSV has a column for every figure; the first three cells of every row repeat scene, measure
/// and reference.
void write_bench_csv(const std::string& path, const BenchTable& table);
/// Throws FileError when it is no such file.
BenchTable read_bench_csv(const std::string& path);
bool is_bench_csv(const TextTable& table);

}  // namespace archetide
