// Draws the frames of a run.

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <cstdio>

#include "runtime/commands/command.h"
#include "runtime/output/render.h"

namespace archetide {
namespace {

// "a:b", "a:", ":b" or "a".
void parse_frame_range(const std::string& text, RenderOptions& options) {
  const std::size_t colon = text.find(':');
  const std::string first = text.substr(0, colon);
  const std::string last = colon == std::string::npos ? first : text.substr(colon + 1);
  const auto number = [&](const std::string& part, int fallback) {
    if (part.empty()) return fallback;
    if (part.size() > 8 || part.find_first_not_of("0123456789") != std::string::npos) {
      throw InputError("--frames " + text + " is no range of frames",
                       "expected a:b, for example 0:48");
    }
    return std::stoi(part);
  };
  options.first_frame = number(first, 0);
  options.last_frame = number(last, -1);
}

void parse_size(const std::string& text, RenderOptions& options) {
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &options.width, &options.height, &end) != 2) {
    throw InputError("--size " + text + " is no size", "expected WIDTHxHEIGHT in pixels, 1280x720");
  }
}

int render(const Arguments& a) {
  RenderOptions options;
  if (!a.frame_range.empty()) parse_frame_range(a.frame_range, options);
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
            app.add_option("--frames", a.frame_range, "first and last frame (default: all)")
                ->type_name("A:B");
            app.add_option("--size", a.size, "pixels")->type_name("WxH")->capture_default_str();
            app.add_flag("--no-film", a.no_film, "pictures only");
          }};
}

}  // namespace archetide
