// The page and the table of the paper's scenes from their runs (tests/bench/paper/run_paper.sh).
#include <cstdio>
#include <string>
#include <vector>

#include "common/files/atomic_file.h"
#include "tests/bench/paper/paper_page.h"
#include "tests/support/bench_main.h"

namespace archetide {
namespace {

int write_pages(int argc, char** argv) {
  const bool quick = argc == 4 && std::string(argv[3]) == "--quick";
  if (argc != 3 && !quick)
    throw InputError("usage: bench_paper SCENES.txt FOLDER of the runs [--quick]");
  const std::string out = argv[2];
  std::vector<PaperRun> runs;
  for (const PaperScene& scene : read_paper_scenes(argv[1]))
    runs.push_back(read_paper_run(out, scene));
  const std::string table = paper_table(runs, quick);
  write_file_atomically(out + "/index.html", paper_page(runs, quick));
  write_file_atomically(out + "/paper.md", table);
  std::printf("%spaper: open %s/index.html\n", table.c_str(), out.c_str());
  return kExitDone;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  return archetide::bench_main(argc, argv, archetide::write_pages);
}
