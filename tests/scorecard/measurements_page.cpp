#include "tests/scorecard/measurements_page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <thread>

namespace archetide {
namespace {

using Cells = std::vector<std::string>;

// A cell of a Markdown table: one line, no separator in it.
std::string cell(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  for (std::size_t n = text.find('|'); n != std::string::npos; n = text.find('|', n + 2))
    text.insert(n, 1, '\\');
  return text;
}

std::string line_of(const Cells& cells) {
  std::string line = "|";
  for (const std::string& c : cells) line += " " + cell(c) + " |";
  return line + "\n";
}

std::string head_of(const Cells& names) {
  std::string rule = "|";
  for (std::size_t n = 0; n < names.size(); ++n) rule += "---|";
  return line_of(names) + rule + "\n";
}

std::string formatted(const char* format, double value) {
  if (std::isnan(value)) return "";
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string number(const TextTable& t, std::size_t n, const char* column, const char* format) {
  return formatted(format, t.number(n, column));
}

std::string count_text(std::size_t count, const std::string& what) {
  return fmt::format("{} {}", count, what);
}

// ---- Known answers ----

bool passes(const TextTable& t, std::size_t n) { return t.at(n, "pass") == "1"; }

std::string verdict(const Measurements& m, std::size_t n) {
  const TextTable& t = m.scores;
  const std::string text = passes(t, n)                ? "pass"
                           : t.at(n, "reason").empty() ? "**miss**"
                                                       : "known miss";
  return text + (t.at(n, "program") == m.program ? "" : " (earlier program)");
}

std::string misses(const TextTable& t) {
  std::string text = head_of({"case", "quantity", "resolution", "error", "target", "reason"});
  for (std::size_t n = 0; n < t.rows.size(); ++n)
    if (!passes(t, n))
      text += line_of({t.at(n, "case"), t.at(n, "quantity"), t.at(n, "resolution"),
                       number(t, n, "error", "%+.2e"), number(t, n, "target", "%.1e"),
                       t.at(n, "reason").empty() ? "not known" : t.at(n, "reason")});
  return text;
}

std::string score_tables(const Measurements& m) {
  const TextTable& t = m.scores;
  std::string text, last;
  for (std::size_t n = 0; n < t.rows.size(); ++n) {
    if (t.at(n, "case") != last) {
      last = t.at(n, "case");
      text += "\n**" + last + "**: " + t.at(n, "about") + "\n\n" +
              head_of({"quantity", "resolution", "value", "reference", "error", "target", "result",
                       "order", "CPU s", "iterations"});
    }
    const std::string iterations = t.at(n, "iterations");
    text += line_of({t.at(n, "quantity"), t.at(n, "resolution"), number(t, n, "value", "%.6g"),
                     number(t, n, "reference", "%.6g"), number(t, n, "error", "%+.2e"),
                     number(t, n, "target", "%.1e"), verdict(m, n), number(t, n, "order", "%.1f"),
                     number(t, n, "cpu_seconds", "%.2f"), iterations == "0" ? "" : iterations});
  }
  return text;
}

std::string scores_section(const Measurements& m) {
  const TextTable& t = m.scores;
  std::size_t missed = 0, known = 0;
  for (std::size_t n = 0; n < t.rows.size(); ++n)
    if (!passes(t, n)) ++missed, known += !t.at(n, "reason").empty();
  std::string text =
      "\n## Known answers\n\nError: value / reference - 1, or the value itself "
      "where the reference is 0. " +
      count_text(t.rows.size() - missed, "rows pass, ") + count_text(known, "misses are known, ") +
      count_text(missed - known, "are not.\n");
  if (missed) text += "\n### Misses\n\n" + misses(t);
  return text + "\n### All rows\n" + score_tables(m);
}

// ---- Hard cases, sweeps, programs, earlier figures ----

std::string hard_section(const TextTable& t) {
  std::string text = "\n## Hard cases\n\nA case passes when all its tests pass.\n\n" +
                     head_of({"case", "what", "quantity", "measured", "bound", "result"});
  for (std::size_t n = 0; n < t.rows.size(); ++n)
    text +=
        line_of({t.at(n, "case"), t.at(n, "what"), t.at(n, "quantity"), t.at(n, "value"),
                 t.at(n, "bound").empty() ? "" : "at most " + t.at(n, "bound"), t.at(n, "result")});
  return text;
}

std::string sweep_table(const std::string& name, const TextTable& t) {
  std::vector<std::size_t> keys;
  Cells head;
  for (std::size_t c = 0; c < t.names.size(); ++c)
    if (t.names[c].starts_with("key:")) keys.push_back(c), head.push_back(t.names[c].substr(4));
  head.insert(head.end(), {"error", "CPU s", "steps", "iterations", "peak MiB", "status"});
  std::string text = "\n**" + name + "**\n\n" + head_of(head);
  for (std::size_t n = 0; n < t.rows.size(); ++n) {
    Cells cells;
    for (const std::size_t c : keys) cells.push_back(t.rows[n][c]);
    const bool reference = t.at(n, "reference") == "1";
    cells.insert(
        cells.end(),
        {reference ? "reference" : number(t, n, "error", "%.2e"),
         number(t, n, "cpu_seconds", "%.1f"), t.at(n, "steps"), t.at(n, "iterations_total"),
         formatted("%.0f", t.number(n, "peak_bytes") / 1048576.0), t.at(n, "status")});
    text += line_of(cells);
  }
  return text;
}

std::string sweeps_section(const Measurements& m) {
  std::string text =
      "\n## Error against CPU seconds\n\nSweeps of `archetide-sim bench`; errors are measured "
      "from the reference.\n";
  for (const auto& [name, table] : m.sweeps) text += sweep_table(name, table);
  return text;
}

std::string benches_section(const TextTable& t) {
  std::string
      text =
          "\n## Programs that print figures\n\nTests pass when the printed figures are within the "
          "bounds of their sources; benches have no bound.\n",
      last;
  for (std::size_t n = 0; n < t.rows.size(); ++n) {
    if (t.at(n, "name") != last) {
      if (!last.empty()) text += "```\n";
      last = t.at(n, "name");
      text += "\n**" + t.at(n, "what") + "**: " + t.at(n, "result") + ", " + t.at(n, "seconds") +
              " s\n\n```text\n$ " + t.at(n, "command") + "\n";
    }
    if (!t.at(n, "line").empty()) text += t.at(n, "line") + "\n";
  }
  return text + "```\n";
}

std::string recorded_section(const TextTable& t) {
  std::string text =
      "\n## Recorded earlier\n\nFigures of earlier versions, some of runs that take hours, with "
      "the command that gives them again. Two cores of an EPYC, Debian bookworm, g++ 12; CPU "
      "seconds to +-20 %. Source: `tests/scorecard/recorded.csv`.\n\n" +
      head_of({"what", "result", "command"});
  for (std::size_t n = 0; n < t.rows.size(); ++n)
    text += line_of({t.at(n, "what"), t.at(n, "result"), "`" + t.at(n, "command") + "`"});
  return text;
}

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", std::gmtime(&now));
  return text;
}

}  // namespace

MeasuredOn measured_here(const std::string& commit) {
  return {cpu_name(), "g++ " __VERSION__, today(), commit.empty() ? "unknown" : commit,
          static_cast<int>(std::thread::hardware_concurrency())};
}

bool has_failures(const Measurements& m) {
  for (const TextTable* t : {&m.hard, &m.benches})
    for (std::size_t n = 0; n < t->rows.size(); ++n)
      if (t->at(n, "result") == "FAILED") return true;
  return false;
}

std::string measurements_page(const Measurements& m) {
  std::string page =
      "# Measurements\n\nWritten by `make -f pipeline.mk measurements`; changes by hand are lost. "
      "Programs without a folder are in `build/bin/`.\n\n" +
      head_of({"CPU", "cores", "compiler", "date", "commit"}) +
      line_of({m.on.cpu, std::to_string(m.on.cores), m.on.compiler, m.on.date, m.on.commit});
  if (!m.scores.rows.empty()) page += scores_section(m);
  if (!m.hard.rows.empty()) page += hard_section(m.hard);
  if (!m.sweeps.empty()) page += sweeps_section(m);
  if (!m.benches.rows.empty()) page += benches_section(m.benches);
  if (!m.recorded.rows.empty()) page += recorded_section(m.recorded);
  return page;
}

}  // namespace archetide
