#pragma once

#include <string>

namespace archetide {

/// How `archetide-sim render` looks at a run.
struct RenderOptions {
  int first_frame = 0, last_frame = -1;  // inclusive; last_frame < 0: to the end
  int width = 1280, height = 720;        // pixels, 16 .. 16384
  double azimuth = 25.0;                 // degrees, camera to the right of the front (-y) side
  double elevation = 22.0;               // degrees above the horizon
  int samples = 2;                       // antialiasing, samples x samples per pixel, 1 .. 8
  bool missing_only = false;             // frames that have a picture keep it
  bool film = true;                      // DIR/film.mp4 when ffmpeg is there
  bool quiet = false;                    // no progress on stderr
};

/// What a rendering left behind.
struct RenderSummary {
  int frames = 0;
  double seconds_per_frame = 0.0;
  std::string film;  // path, empty when there is none
};

/// True when this build can render (embree and libpng were there).
bool render_available();

/// Draws frames/*.ply and *.vtp of a run folder into DIR/pictures/frame.000012.png, and
/// DIR/film.mp4. Throws FileError when the folder is no run or lacks frames, InputError for bad
/// options. A build that cannot render says so in one line and draws nothing.
RenderSummary render_run(const std::string& directory, const RenderOptions& options);

}  // namespace archetide
