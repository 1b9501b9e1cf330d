// Writes the page of a run again every few frames while the run goes on.

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <thread>

#include "common/files/atomic_file.h"
#include "runtime/commands/command.h"
#include "runtime/commands/interrupt.h"
#include "runtime/output/render.h"
#include "runtime/output/report.h"
#include "runtime/output/run_folder.h"

namespace archetide {
namespace {

constexpr std::chrono::milliseconds kPause(500);

// Pictures of the frames that have none yet, small ones, and the page about what there is.
void write_page(const RunFolder& run, const std::string& page) {
  RenderOptions options;
  options.width = 640, options.height = 360;
  options.missing_only = options.quiet = true;
  options.film = false;
  if (render_available() && !run.frames.empty()) render_run(run.path, options);
  make_folder_of(page);
  write_report({run.path}, page);
  const double shown = run.frames.empty() ? 0.0 : run.frames.back().number / run.manifest.fps;
  log_info(fmt::format("{}: {} frames, {:.3f} of {:.3f} s", page, run.frames.size(), shown,
                       run.manifest.end_time));
}

int watch(const Arguments& a) {
  stop_on_signals();
  const std::string page = a.out.empty() ? a.directory + "/report.html" : a.out;
  std::size_t shown = 0;
  while (true) {
    const RunFolder run = open_run_folder(a.directory);
    const bool ended = run.manifest.exit >= 0;
    if (ended || run.frames.size() >= shown + static_cast<std::size_t>(a.every)) {
      write_page(run, page);
      shown = run.frames.size();
    }
    if (ended) return kExitDone;
    if (interrupted) return kExitStopped;
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace

SimCommand watch_command() {
  return {"watch",
          "the page of a run, written again every few frames until the run ends",
          {"watch out/runs/tub", "watch out/runs/tub --every 24 -o out/tub.html"},
          watch,
          [](CLI::App& app, Arguments& a) {
            app.add_option("run", a.directory, "run folder")->required()->type_name("RUN");
            app.add_option("--every", a.every, "frames between two pages")
                ->check(CLI::PositiveNumber)
                ->type_name("N")
                ->capture_default_str();
            app.add_option("-o,--output", a.out, "the page (default: RUN/report.html)")
                ->type_name("FILE");
          },
          "Frames without a picture are drawn, with 640 x 360 pixels. A run that was killed is "
          "watched until it is resumed and ends; Ctrl-C ends watching, not the run.\n\n"};
}

}  // namespace archetide
