#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/files/text_csv.h"

namespace archetide {

/// Where and when figures were measured.
struct MeasuredOn {
  std::string cpu, compiler, date, commit;
  int cores = 0;
};

/// This machine and this program, now. `commit`: of the sources, as given.
MeasuredOn measured_here(const std::string& commit);

/// What the page is made of; an empty table leaves its section out.
struct Measurements {
  MeasuredOn on;
  std::string program;  // hash of the scorecard program, as in its column "program"
  TextTable scores;     // scorecard.csv
  TextTable hard;       // hard.csv of tests/hard/run_cases.sh
  TextTable benches;    // benches.csv of tests/bench/run_benches.sh: one row per printed line
  std::vector<std::pair<std::string, TextTable>> sweeps;  // name, bench.csv
  TextTable recorded;  // figures of earlier versions: what, result, command
};

/// Whether a hard case or a program of `benches` has failed.
bool has_failures(const Measurements& m);

/// docs/measurements.md: tables in Markdown.
std::string measurements_page(const Measurements& m);

}  // namespace archetide
