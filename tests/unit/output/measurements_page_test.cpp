#include "tests/scorecard/measurements_page.h"

#include <gtest/gtest.h>

#include "tests/support/holds.h"

namespace archetide {
namespace {

Measurements sample() {
  Measurements m;
  m.on = {"A CPU", "g++ 12.2.0", "2026-11-25", "abc1234", 2};
  m.program = "p1";
  m.scores.names = {"case",  "quantity",    "resolution", "value", "reference", "error",   "target",
                    "order", "cpu_seconds", "iterations", "pass",  "reason",    "program", "about"};
  m.scores.rows = {
      {"ball", "mass", "4 cells", "0.5", "0.4", "0.25", "0.5", "", "1.5", "7", "1", "", "p1", "A"},
      {"ball", "mass", "8 cells", "0.5", "0.4", "0.25", "0.1", "2", "1", "0", "0", "", "p0", "A"},
      {"cube", "a|b", "", "1", "0", "1", "0.1", "", "", "0", "0", "coarse", "p1", "B"}};
  return m;
}

TEST(MeasurementsPage, NamesMachineDateAndCommit) {
  const std::string page = measurements_page(sample());
  EXPECT_TRUE(holds(page, "| CPU | cores | compiler | date | commit |\n|---|---|---|---|---|\n"));
  EXPECT_TRUE(holds(page, "| A CPU | 2 | g++ 12.2.0 | 2026-11-25 | abc1234 |\n")) << page;
}

TEST(MeasurementsPage, SaysOfEachRowWhetherItPasses) {
  const std::string page = measurements_page(sample());
  EXPECT_TRUE(holds(page, "1 rows pass, 1 misses are known, 1 are not."));
  EXPECT_TRUE(holds(page, "**ball**: A\n\n| quantity |"));
  EXPECT_TRUE(
      holds(page, "| mass | 4 cells | 0.5 | 0.4 | +2.50e-01 | 5.0e-01 | pass |  | 1.50 | 7 |"));
  EXPECT_TRUE(holds(page, "| **miss** (earlier program) | 2.0 | 1.00 |  |"));
  EXPECT_TRUE(holds(page, "| known miss |"));
  EXPECT_TRUE(holds(page, "| ball | mass | 8 cells | +2.50e-01 | 1.0e-01 | not known |"));
  EXPECT_TRUE(holds(page, "| cube | a\\|b |  | +1.00e+00 | 1.0e-01 | coarse |"));
}

TEST(MeasurementsPage, ShowsSweepsHardCasesAndPrintedLines) {
  Measurements m = sample();
  m.hard.names = {"case", "what", "quantity", "value", "bound", "result"};
  m.hard.rows = {{"H01", "ratios", "drift", "1e-3", "0.01", "passed"},
                 {"H02", "stiff", "", "", "", "FAILED"}};
  m.benches.names = {"name", "what", "command", "result", "seconds", "line"};
  m.benches.rows = {{"b", "Speed", "bench_b 1", "done", "3", "x  1"},
                    {"b", "Speed", "bench_b 1", "done", "3", "y  2"}};
  TextTable sweep;
  sweep.names = {"key:step.cfl",     "error",      "cpu_seconds", "steps",
                 "iterations_total", "peak_bytes", "reference",   "status"};
  sweep.rows = {{"1", "0.01", "2.5", "10", "70", "1048576", "0", "done"},
                {"0.5", "", "5", "20", "140", "", "1", "done"}};
  m.sweeps = {{"cfl", sweep}};
  m.recorded.names = {"what", "result", "command"};
  m.recorded.rows = {{"old", "1 %", "test_x"}};
  EXPECT_FALSE(has_failures(sample()));
  EXPECT_TRUE(has_failures(m));
  const std::string page = measurements_page(m);
  EXPECT_TRUE(holds(page, "| H01 | ratios | drift | 1e-3 | at most 0.01 | passed |\n"));
  EXPECT_TRUE(holds(page, "| H02 | stiff |  |  |  | FAILED |\n"));
  EXPECT_TRUE(holds(page, "**Speed**: done, 3 s\n\n```text\n$ bench_b 1\nx  1\ny  2\n```\n"));
  EXPECT_TRUE(holds(page, "| 1 | 1.00e-02 | 2.5 | 10 | 70 | 1 | done |\n")) << page;
  EXPECT_TRUE(holds(page, "| 0.5 | reference | 5.0 | 20 | 140 |  | done |\n"));
  EXPECT_TRUE(holds(page, "| old | 1 % | `test_x` |\n"));
}

TEST(MeasurementsPage, LeavesOutWhatWasNotMeasured) {
  const std::string page = measurements_page({});
  EXPECT_FALSE(holds(page, "## "));
}

}  // namespace
}  // namespace archetide
