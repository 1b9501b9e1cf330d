// Writes a page about runs, sweeps and scorecards.

#include "runtime/output/report.h"

#include <CLI/CLI.hpp>
#include "common/files/atomic_file.h"
#include "runtime/commands/command.h"

namespace archetide {
namespace {

int report(const Arguments& a) {
  make_folder_of(a.out);
  write_report(a.directories, a.out);
  return kExitDone;
}

}  // namespace

SimCommand report_command() {
  return {"report",
          "one self-contained HTML page about runs, sweeps and scorecards",
          {"report out/runs/tub -o out/report.html",
           "report out/runs/tub out/bench/tub out/scorecard.csv -o out/report.html"},
          report,
          [](CLI::App& app, Arguments& a) {
            app.add_option("dirs", a.directories,
                           "run folders, folders of bench, their CSV files, scorecard.csv")
                ->required()
                ->type_name("DIR");
            app.add_option("-o,--output", a.out, "the page")->required()->type_name("FILE");
          }};
}

}  // namespace archetide
