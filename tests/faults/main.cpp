// What happens to runs and builds when the world around them fails: a row for each fault.

#include <cstdio>
#include <cstring>
#include <exception>
#include <set>

#include "tests/faults/workshop.h"

namespace archetide {
namespace {

constexpr char kHelp[] =
    "faults BIN FOLDER [--quick] [--seed N] [ROW...]\n"
    "Runs the programs in BIN into FOLDER, which is emptied, and does to them what can happen. A "
    "row for each fault;\n"
    "--quick: a tenth of the trials. Exit 0 when every row passes, 3 when one fails, 2 for other "
    "words.\n";

std::vector<Row> all_rows() {
  std::vector<Row> rows;
  for (const auto* part : {&kill_rows(), &signal_rows(), &machine_rows(), &environment_rows()})
    rows.insert(rows.end(), part->begin(), part->end());
  return rows;
}

int faults(int argc, char** argv) {
  double share = 1.0;
  unsigned seed = 1;
  std::vector<std::string> words;
  for (int n = 1; n < argc; ++n) {
    if (std::strcmp(argv[n], "--quick") == 0)
      share = 0.1;
    else if (std::strcmp(argv[n], "--seed") == 0 && n + 1 < argc)
      seed = static_cast<unsigned>(std::stoul(argv[++n]));
    else
      words.emplace_back(argv[n]);
  }
  if (words.size() < 2) return std::fputs(kHelp, stderr), 2;
  Workshop workshop(words[0], words[1], seed);
  const std::set<std::string> wanted(words.begin() + 2, words.end());
  std::printf("seed %u, a run of %.2f s, a build of %.2f s\n", seed, workshop.run_seconds(),
              workshop.build_seconds());
  int failed = 0, found = 0;
  for (const Row& row : all_rows()) {
    if (!wanted.empty() && !wanted.contains(row.name)) continue;
    ++found;
    std::string figures;
    const std::string wrong = row.test(workshop, share, figures);
    const bool skipped = figures.starts_with("skipped");
    std::printf("%-16s %-8s %-72s %s\n", row.name,
                !wrong.empty() ? "FAILED"
                : skipped      ? "skipped"
                               : "passed",
                row.what, wrong.empty() ? figures.c_str() : wrong.c_str());
    std::fflush(stdout);
    failed += !wrong.empty();
  }
  if (found == 0) return std::fputs("no such row\n", stderr), 2;
  return failed > 0 ? 3 : 0;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  try {
    return archetide::faults(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "faults: %s\n", error.what());
    return 1;
  }
}
