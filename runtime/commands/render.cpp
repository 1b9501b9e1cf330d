// Draws the frames of a run.

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <cstdio>

#include "runtime/commands/command.h"
#include "runtime/output/render.h"

namespace archetide {
namespace {

void parse_size(const std::string& text, RenderOptions& options) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &options.width, &options.height, &end) != 2) {
    throw InputError("--size " + text + " is no size", "expected WIDTHxHEIGHT in pixels, 1280x720");
  }
}

int render(const Arguments& a) {
  RenderOptions options;
  const FrameRange frames = frame_range(a);
  options.first_frame = frames.first, options.last_frame = frames.last;
  parse_size(a.size, options);
  options.film = !a.no_film;
  options.quiet = a.common.quiet;
  const RenderSummary summary = render_run(a.directory, options);
  log_info(fmt::format("{} pictures, {:f} s each{}", summary.frames, summary.seconds_per_frame,
                       summary.film.empty() ? ", no film" : ", film " + summary.film));
  return kExitDone;
}

}  // namespace

SimCommand render_command() {
  return {"render",
          "a PNG per frame, and a film when ffmpeg is there",
          {"render out/runs/tub --size 1280x720", "render out/runs/tub --frames 24:48 --no-film"},
          render,
          [](CLI::App& app, Arguments& a) {
            app.add_option("dir", a.directory, "run folder")->required()->type_name("DIR");
            frames_option(app, a);
            app.add_option("--size", a.size, "pixels")->type_name("WxH")->capture_default_str();
            app.add_flag("--no-film", a.no_film, "pictures only");
          }};
}

}  // namespace archetide
