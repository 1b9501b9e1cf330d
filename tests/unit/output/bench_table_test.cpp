#include "runtime/output/bench_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "runtime/output/report.h"
#include "runtime/output/svg_error_chart.h"
#include "tests/unit/output/scratch_folder.h"

namespace archetide {
namespace {

BenchRow row(const std::string& a, const std::string& b, double error, double cpu) {
  BenchRow r = empty_bench_row({a, b});
  r.error = error, r.cpu_seconds = cpu;
  return r;
}

TEST(BenchTable, FrontIsWhatNothingBeatsInBoth) {
  std::vector<BenchRow> rows = {row("1", "x", 0.1, 1), row("2", "x", 0.05, 2),
                                row("3", "x", 0.06, 3), row("4", "x", 0.01, 9)};
  rows.push_back(row("5", "x", NAN, 0.1));
  rows.push_back(row("6", "x", 0.0, 0.1));
  rows[5].reference = true;
  mark_pareto(rows);
  const bool expected[] = {true, true, false, true, false, false};
  for (int n = 0; n < 6; ++n) EXPECT_EQ(rows[n].pareto, expected[n]) << n;
}

TEST(BenchTable, OrdersAreBetweenPointsThatDifferInOneKey) {
  std::vector<BenchRow> rows = {row("0.1", "x", 0.4, 1), row("0.1", "y", 0.3, 1),
                                row("0.05", "x", 0.1, 2), row("0.05", "y", 0.3, 2),
                                row("0", "x", 0.1, 2)};
  fill_orders(rows, 0, {0.1, 0.1, 0.05, 0.05, 0.0});
  EXPECT_TRUE(std::isnan(rows[0].order));
  EXPECT_NEAR(rows[2].order, 2.0, 1e-12);
  EXPECT_NEAR(rows[3].order, 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(rows[4].order));  // 0 has no ratio
}

TEST(BenchTable, ComesBackFromItsFile) {
  const ScratchFolder folder;
  BenchTable t{"a, \"scene\"", {"fluid.grid", "b"}, "measure", "against", {}};
  t.rows = {row("[8, 8, 8]", "x", 0.1, 1.5), row("[16, 16, 16]", "x", NAN, 3)};
  t.rows[1].failed = true, t.rows[1].status = "failed: signal 11";
  t.rows[0].pareto = true, t.rows[0].steps = 7;
  write_bench_csv(folder / "t.csv", t);
  const BenchTable u = read_bench_csv(folder / "t.csv");
  EXPECT_EQ(u.scene, t.scene);
  EXPECT_EQ(u.keys, t.keys);
  ASSERT_EQ(u.rows.size(), 2u);
  EXPECT_EQ(u.rows[0].values, t.rows[0].values);
  EXPECT_EQ(u.rows[0].error, 0.1);
  EXPECT_EQ(u.rows[0].steps, 7);
  EXPECT_TRUE(u.rows[0].pareto);
  EXPECT_TRUE(std::isnan(u.rows[1].error));
  EXPECT_TRUE(u.rows[1].failed);
  EXPECT_EQ(u.rows[1].status, "failed: signal 11");
  EXPECT_NE(bench_text(u).find("failed: signal 11"), std::string::npos);
}

TEST(TextCsv, KeepsCommasQuotesAndLineEnds) {
  const ScratchFolder folder;
  const TextTable t{{"a", "b"}, {{"1,2", "he said \"no\""}, {"two\nlines", ""}}};
  write_text_csv(folder / "t.csv", t);
  const TextTable u = read_text_csv(folder / "t.csv");
  EXPECT_EQ(u.names, t.names);
  EXPECT_EQ(u.rows, t.rows);
  EXPECT_TRUE(std::isnan(u.number(0, "a")));
  EXPECT_EQ(u.at(0, "none"), "");
}

TEST(TextCsv, RefusesARowOfAnotherLength) {
  const ScratchFolder folder;
  write_text_csv(folder / "t.csv", {{"a", "b"}, {{"1"}}});
  EXPECT_THROW(read_text_csv(folder / "t.csv"), FileError);
  EXPECT_THROW(read_text_csv(folder / "none.csv"), FileError);
}

TEST(Report, ShowsMissesOfAScorecardWithTheirReasons) {
  const ScratchFolder folder;
  write_text_csv(
      folder / "s.csv",
      {{"case", "about", "quantity", "resolution", "value", "reference", "error", "target", "order",
        "cpu_seconds", "iterations", "pass", "reason"},
       {{"good", "fine <case>", "q", "8", "1.001", "1", "0.001", "0.01", "2", "1", "3", "1", ""},
        {"bad", "b", "q", "8", "2", "1", "1", "0.01", "", "1", "3", "0", "as the paper"},
        {"worse", "w", "q", "8", "2", "1", "1", "0.01", "", "1", "3", "0", ""}}});
  write_report({folder / "s.csv"}, folder / "r.html");
  const std::string html = read_whole_file(folder / "r.html");
  for (const char* text : {"1 of 3 figures meet their target", "fine &lt;case&gt;",
                           "Known: as the paper", "Not known: look at it", "10000 %"})
    EXPECT_NE(html.find(text), std::string::npos) << text;
}

TEST(Report, RefusesATableThatIsNeither) {
  const ScratchFolder folder;
  write_text_csv(folder / "s.csv", {{"a"}, {{"1"}}});
  EXPECT_THROW(write_report({folder / "s.csv"}, folder / "r.html"), FileError);
}

TEST(ErrorChart, LeavesOutWhatHasNoLogarithm) {
  const std::string svg = svg_error_chart(
      "t", "x", "y",
      {{"a", "#000", {1, 2, 3}, {0.1, 0.0, NAN}, {"1", "2", "3"}, {true, false, false}}});
  std::size_t circles = 0;
  for (std::size_t at = 0; (at = svg.find("<circle", at)) != std::string::npos; ++at) ++circles;
  EXPECT_EQ(circles, 1u);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace archetide
