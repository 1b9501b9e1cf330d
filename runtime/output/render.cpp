#include "runtime/output/render.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>

#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/image.h"
#include "runtime/output/film.h"
#include "runtime/output/painter.h"
#include "runtime/output/ply.h"
#include "runtime/output/run_folder.h"
#include "runtime/output/vtp.h"

namespace archetide {
namespace {

using Clock = std::chrono::steady_clock;

void check_options(const RenderOptions& o) {
  std::vector<Diagnostic> wrong;
  const auto need = [&](bool good, const char* what) {
    if (good) return;
    Diagnostic complaint;
    complaint.what = what;
    wrong.push_back(complaint);
  };
  need(o.width >= 16 && o.height >= 16 && o.width <= 16384 && o.height <= 16384,
       "--size: each side must be 16 to 16384 pixels");
  need(o.samples >= 1 && o.samples <= 8, "samples per pixel side must be 1 to 8");
  need(o.elevation > -89.0 && o.elevation < 89.0, "elevation must lie between -89 and 89 degrees");
  need(o.first_frame >= 0, "--frames: the first frame must not be negative");
  if (!wrong.empty()) throw InputError(wrong);
}

std::vector<FrameFiles> chosen_frames(const RunFolder& run, const RenderOptions& o) {
  std::vector<FrameFiles> chosen;
  for (const FrameFiles& f : run.frames)
    if (f.number >= o.first_frame && (o.last_frame < 0 || f.number <= o.last_frame))
      chosen.push_back(f);
  if (!chosen.empty()) return chosen;
  if (run.frames.empty())
    throw FileError(run.path + "frames: nothing to draw (surface.*.ply, bodies.*.vtp)");
  throw FileError(fmt::format("{}frames: no frame in the range; there are {} to {}", run.path,
                              run.frames.front().number, run.frames.back().number));
}

// Without a tank the picture holds wherever the bodies go; a dozen frames tell.
void enclose_bodies(const std::vector<FrameFiles>& frames, PaintedScene& scene) {
  scene.low = Vec3::Constant(1e30), scene.high = -scene.low;
  const std::size_t stride = std::max<std::size_t>(1, frames.size() / 12);
  for (std::size_t f = 0; f < frames.size(); f += stride) {
    if (frames[f].bodies.empty()) continue;
    for (const Vec3& x : read_vtp(frames[f].bodies).vertices)
      scene.low = scene.low.cwiseMin(x), scene.high = scene.high.cwiseMax(x);
  }
  if (scene.low[0] > scene.high[0]) scene.low.setZero(), scene.high.setOnes();
  const Vec3 margin = Vec3::Constant(0.05 * (scene.high - scene.low).norm());
  scene.low -= margin, scene.high += margin;
}

PaintedScene empty_scene(const RunFolder& run, const std::vector<FrameFiles>& frames) {
  PaintedScene scene;
  const Grid& g = run.manifest.grid;
  scene.has_tank = g.cells() > 0;
  if (scene.has_tank)
    scene.low = g.low(), scene.high = g.high();
  else
    enclose_bodies(frames, scene);
  const std::string obstacles = run.path + "frames/obstacles.ply";
  if (std::filesystem::exists(obstacles)) scene.obstacles = read_ply(obstacles);
  return scene;
}

std::string picture_path(const std::string& folder, int frame) {
  char name[32];
  std::snprintf(name, sizeof name, "frame.%06d.png", frame);
  return folder + name;
}

// Numbers without gaps, which is what ffmpeg reads.
bool consecutive(const std::vector<FrameFiles>& frames) {
  return frames.back().number - frames.front().number + 1 == static_cast<int>(frames.size());
}

}  // namespace

bool render_available() { return RayScene::available() && png_available(); }

RenderSummary render_run(const std::string& directory, const RenderOptions& options) {
  check_options(options);
  if (!render_available()) {
    std::fprintf(stderr, "render: off (needs libembree-dev and libpng-dev, then build again)\n");
    return {};
  }
  const RunFolder run = open_run_folder(directory);
  const std::vector<FrameFiles> frames = chosen_frames(run, options);
  const std::string folder = run.path + "pictures/";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw MachineError(folder + ": cannot be made: " + error.message());

  PaintedScene scene = empty_scene(run, frames);
  const Camera camera(scene.low, scene.high, options.azimuth, options.elevation, options.width,
                      options.height);
  const auto say = [&](const std::string& line) {
    if (!options.quiet) std::fprintf(stderr, "%s\n", line.c_str());
  };
  RenderSummary summary;
  const auto start = Clock::now();
  for (const FrameFiles& files : frames) {
    if (options.missing_only && std::filesystem::exists(picture_path(folder, files.number)))
      continue;
    const auto frame_start = Clock::now();
    scene.water = files.surface.empty() ? SurfaceMesh() : read_ply(files.surface);
    scene.bodies = files.bodies.empty() ? SurfaceMesh() : read_vtp(files.bodies);
    scene.markers.clear();
    if (!files.markers.empty()) scene.markers = read_vtp(files.markers).vertices;
    scene.spray.clear();
    if (!files.spray.empty()) scene.spray = read_vtp(files.spray).vertices;
    const Image image =
        Painter(scene).paint(camera, options.width, options.height, options.samples);
    write_png(picture_path(folder, files.number), image);
    ++summary.frames;
    const std::chrono::duration<double> took = Clock::now() - frame_start;
    say(fmt::format("picture {} of {}  {} s", files.number, frames.back().number,
                    fixed_text(took.count(), 2)));
  }
  const std::chrono::duration<double> total = Clock::now() - start;
  summary.seconds_per_frame = total.count() / std::max(1, summary.frames);

  if (options.film && summary.frames > 1) {
    const std::string film = run.path + "film.mp4";
    const std::string problem =
        consecutive(frames)
            ? make_film(folder, frames.front().number, summary.frames, run.manifest.fps, film)
            : "film: off (frames are missing in between)";
    if (problem.empty()) summary.film = film;
    say(problem.empty() ? film : problem);
  }
  return summary;
}

}  // namespace archetide
