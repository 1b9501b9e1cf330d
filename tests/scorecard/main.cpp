// Every quantity with a known answer: value, reference, error, target, cost.
//   scorecard [--quick] [--only CASE]... [--list] [-o scorecard.csv]
//             [--report PAGE.md [--commit TEXT] [--hard hard.csv] [--benches benches.csv]
//              [--sweep bench.csv]... [--recorded recorded.csv]]
// Rows that are in the file already, of the same program, are kept. --report writes all rows, and
// the other tables that are there, as docs/measurements.md. Exit 0: every row meets its
// target, or misses it as it is known to; 3: another row misses.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>

#include "common/base/input_error.h"
#include "common/base/sha256.h"
#include "common/files/atomic_file.h"
#include "common/files/text_csv.h"
#include "common/params/cli.h"
#include "tests/scorecard/measurements_page.h"
#include "tests/scorecard/score.h"

namespace archetide {
namespace {

const std::vector<std::string> kColumns = {"case",        "quantity",   "resolution", "value",
                                           "reference",   "error",      "target",     "order",
                                           "cpu_seconds", "iterations", "pass",       "reason",
                                           "known_error", "program",    "about"};

struct Request {
  bool quick = false, list = false, help = false;
  std::vector<std::string> only;
  std::string file = "scorecard.csv";
  // of the page
  std::string page, commit, hard, benches, recorded;
  std::vector<std::string> sweeps;
};

const char* const kUsage =
    "scorecard [--quick] [--only CASE]... [--list] [-o scorecard.csv] [--report PAGE.md "
    "[--commit TEXT] [--hard FILE] [--benches FILE] [--sweep FILE]... [--recorded FILE]]";

Request request_of(int argc, char** argv) {
  Request r;
  const std::map<std::string, std::string*> texts = {
      {"-o", &r.file},     {"--report", &r.page},     {"--commit", &r.commit},
      {"--hard", &r.hard}, {"--benches", &r.benches}, {"--recorded", &r.recorded}};
  const std::map<std::string, std::vector<std::string>*> lists = {{"--only", &r.only},
                                                                  {"--sweep", &r.sweeps}};
  for (int n = 1; n < argc; ++n) {
    const std::string word = argv[n];
    const bool more = n + 1 < argc;
    if (word == "--quick")
      r.quick = true;
    else if (word == "--list")
      r.list = true;
    else if (word == "-h" || word == "--help")
      r.help = true;
    else if (texts.count(word) && more)
      *texts.at(word) = argv[++n];
    else if (lists.count(word) && more)
      lists.at(word)->push_back(argv[++n]);
    else
      throw InputError("scorecard: unknown or incomplete option " + word, kUsage);
  }
  return r;
}

std::vector<ScoreCase> all_cases() {
  std::vector<ScoreCase> all;
  for (const auto& family : {single_solve_scores(), water_scores(), dry_body_scores(),
                             coupled_scores(), elastic_scores()})
    all.insert(all.end(), family.begin(), family.end());
  return all;
}

std::vector<ScoreCase> chosen(const Request& r) {
  std::vector<ScoreCase> cases = all_cases();
  std::vector<std::string> names;
  for (const ScoreCase& c : cases) names.push_back(c.name);
  for (const std::string& name : r.only)
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw InputError("scorecard: there is no case " + name,
                       "nearest: " + closest_match(name, names) + "; --list names all");
  std::erase_if(cases, [&](const ScoreCase& c) {
    if (!r.only.empty()) return std::find(r.only.begin(), r.only.end(), c.name) == r.only.end();
    return r.quick && !c.quick;
  });
  return cases;
}

std::vector<std::string> cells_of(const ScoreCase& c, const ScoreRow& row,
                                  const std::string& program) {
  return {c.name,
          row.quantity,
          row.resolution,
          cell_text(row.value),
          cell_text(row.reference),
          cell_text(row.error),
          cell_text(row.target),
          cell_text(row.order),
          cell_text(row.cpu_seconds),
          std::to_string(row.iterations),
          row.meets_target() ? "1" : "0",
          row.known_reason,
          row.known_reason.empty() ? "" : cell_text(row.known_error),
          program,
          c.about};
}

// One line for people, from the cells of the file.
bool print_row(const TextTable& table, std::size_t n) {
  ScoreRow row;
  row.error = table.number(n, "error"), row.target = table.number(n, "target");
  row.known_reason = table.at(n, "reason");
  if (!row.known_reason.empty()) row.known_error = table.number(n, "known_error");
  const double order = table.number(n, "order");
  char order_text[16] = "   -";
  if (std::isfinite(order)) std::snprintf(order_text, sizeof order_text, "%4.1f", order);
  const bool good = row.as_known();
  std::printf("%-22s %-34s %-26s %13.6g %13.6g %+10.2e %8.1e %s %8.2f s %3s  %s%s\n",
              table.at(n, "case").c_str(), table.at(n, "quantity").c_str(),
              table.at(n, "resolution").c_str(), table.number(n, "value"),
              table.number(n, "reference"), row.error, row.target, order_text,
              table.number(n, "cpu_seconds"), table.at(n, "iterations").c_str(),
              row.meets_target()         ? "pass"
              : row.known_reason.empty() ? "MISS"
                                         : "miss: ",
              row.meets_target() ? "" : row.known_reason.c_str());
  if (!good && !row.known_reason.empty())
    std::printf("    no longer as it is known (%+.2e): update the list\n", row.known_error);
  return good;
}

// A table of another program; empty when it has not been made.
TextTable table_if_there(const std::string& file) {
  return file.empty() || !std::filesystem::exists(file) ? TextTable{} : read_text_csv(file);
}

// Writes the page; false when a hard case or a bench on it has failed.
bool write_page(const Request& request, const TextTable& scores, const std::string& program) {
  Measurements m{measured_here(request.commit),
                 program,
                 scores,
                 table_if_there(request.hard),
                 table_if_there(request.benches),
                 {},
                 table_if_there(request.recorded)};
  for (const std::string& file : request.sweeps)
    if (std::filesystem::exists(file))
      m.sweeps.emplace_back(std::filesystem::path(file).parent_path().filename().string(),
                            read_text_csv(file));
  write_file_atomically(request.page, measurements_page(m));
  return !has_failures(m);
}

int score_all(const Request& request) {
  if (request.help) {
    std::printf("%s\nMeasures every quantity with a known answer; --list names the cases.\n",
                kUsage);
    return kExitDone;
  }
  const std::vector<ScoreCase> cases = chosen(request);
  if (request.list) {
    for (const ScoreCase& c : cases)
      std::printf("%-22s %s%s\n", c.name.c_str(), c.quick ? "(quick) " : "", c.about.c_str());
    return kExitDone;
  }
  const std::string program = sha256_of_file("/proc/self/exe").substr(0, 16);
  TextTable table{kColumns, {}};
  if (std::filesystem::exists(request.file)) {
    const TextTable before = read_text_csv(request.file);
    if (before.names == kColumns) table = before;
  }
  bool good = true;
  for (const ScoreCase& c : cases) {
    const auto mine = [&](const std::vector<std::string>& row) { return row[0] == c.name; };
    const auto current = [&](const std::vector<std::string>& row) {
      return mine(row) && row[13] == program;
    };
    if (std::none_of(table.rows.begin(), table.rows.end(), current)) {
      const std::vector<ScoreRow> rows = c.run();
      std::erase_if(table.rows, mine);
      for (const ScoreRow& row : rows) table.rows.push_back(cells_of(c, row, program));
      write_text_csv(request.file, table);
    }
    for (std::size_t n = 0; n < table.rows.size(); ++n)
      if (mine(table.rows[n])) good = print_row(table, n) && good;
    std::fflush(stdout);
  }
  if (!request.page.empty()) good = write_page(request, table, program) && good;
  return good ? kExitDone : kExitNumerics;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  return archetide::guarded_main(
      [&] { return archetide::score_all(archetide::request_of(argc, argv)); });
}
