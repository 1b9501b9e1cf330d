#pragma once

#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "runtime/bench/sweep.h"
#include "runtime/output/bench_table.h"

namespace archetide {

/// Options of `archetide-sim bench`.
struct BenchRequest {
  std::string program;  // this executable: every point is a process of its own
  std::string scene, archetypes;
  std::vector<std::string> overrides;   // of all points, key=value
  std::vector<std::string> sweeps;      // "key=v1,v2,..."
  std::vector<std::string> references;  // a run's folder, a value of the first key, or key=value
  std::string out;                      // folder of points/ and bench.csv
  std::string csv;                      // another copy of the table, or ""
  std::optional<double> until;          // s
  int threads = 0;                      // of every run; 0: as the program decides
};

/// What the points are compared with.
struct BenchReference {
  std::string folder;                             // of a finished run, or ""
  std::optional<SweepPoint> point;                // or this one, which may be a run of its own
  std::string text = "closed forms of [expect]";  // or, when neither is there, those
};

/// Empty `references`: the closed forms of [expect] where the scene has any, else the last value of
/// every key. Throws InputError, FileError.
BenchReference bench_reference(const std::vector<std::string>& references,
                               const std::vector<Sweep>& sweeps, const SceneSpec& base,
                               bool keep_grid);

/// Runs every point that is not there already and writes the table. A point that fails is a row of
/// the table. Stops early, with what is there, when `stop` is set. Throws InputError, FileError,
/// MachineError.
BenchTable run_bench(const BenchRequest& request, const volatile std::sig_atomic_t& stop);

/// The norms, for --help.
std::string bench_help();

}  // namespace archetide
