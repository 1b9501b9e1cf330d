#include "runtime/output/run_info.h"

#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/json_text.h"
#include "runtime/output/checkpoint.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

// done | going on | stopped | failed. A run that something killed still says that it goes on.
std::string state_of(const RunFolder& run) {
  if (fs::exists(run.path + "done.stamp")) return "done";
  if (run.manifest.exit < 0) return "going on";
  return run.manifest.exit == kExitStopped ? "stopped" : "failed";
}

double bytes_in(const std::string& folder) {
  double bytes = 0.0;
  std::error_code gone;  // a file of a run that goes on
  for (const auto& entry : fs::recursive_directory_iterator(folder, gone))
    if (entry.is_regular_file(gone)) bytes += static_cast<double>(entry.file_size(gone));
  return bytes;
}

// "3 torus (11 modes), 1 rock (rigid)"
std::string bodies_text(const Manifest& m) {
  std::map<std::string, int> counts;
  for (const Manifest::BodyEntry& body : m.bodies)
    ++counts[body.archetype +
             (body.modes > 0 ? fmt::format(" ({} modes)", body.modes) : " (rigid)")];
  std::string text;
  for (const auto& [kind, count] : counts)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, kind);
  return text.empty() ? "none" : text;
}

std::string tank_text(const Manifest& m) {
  if (m.grid.cells() == 0) return "none";
  return fmt::format("{} x {} x {} cells of {:.4g} m, {}", m.grid.nx, m.grid.ny, m.grid.nz,
                     m.grid.dx, m.has_water ? "water" : "dry");
}

// The last one, where the run goes on; empty: none.
std::string checkpoint_of(const RunFolder& run) {
  return fs::path(latest_checkpoint(run.path).value_or("")).lexically_normal().string();
}

}  // namespace

std::string run_info_text(const RunFolder& run) {
  const Manifest& m = run.manifest;
  std::string text;
  const auto line = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<12}{}\n", name, value);
  };
  line("state", state_of(run) + (m.reason.empty() ? "" : ": " + m.reason));
  line("scene", m.scene);
  line("tank", tank_text(m));
  line("bodies", bodies_text(m));
  line("time", fmt::format("{:.6g} of {:.6g} s, {} frames, {} steps, {} halvings", m.time,
                           m.end_time, m.frames, m.steps, m.halvings));
  line("cost",
       fmt::format("{} of wall time, {:.2f} s a frame on {} thread{}, at most {}",
                   duration_text(m.wall_seconds), m.wall_seconds / std::max(1, m.frames - 1),
                   m.threads, m.threads == 1 ? "" : "s", bytes_text(m.peak_bytes)));
  line("worst", fmt::format("{} iterations, volume {} off", m.worst_iterations,
                            scientific_text(m.worst_volume_drift)));
  line("program", m.version + ", " + m.build);
  const std::string checkpoint = checkpoint_of(run);
  line("checkpoint", checkpoint.empty() ? "none" : checkpoint);
  line("on disk", fmt::format("{} frames, {} pictures, {}", run.frames.size(), run.pictures.size(),
                              bytes_text(bytes_in(run.path))));
  return text;
}

std::string run_info_json(const RunFolder& run) {
  auto out = nlohmann::ordered_json::parse(read_whole_file(run.path + "manifest.json"));
  const std::string checkpoint = checkpoint_of(run);
  out["state"] = state_of(run);
  out["frames_on_disk"] = run.frames.size();
  out["pictures"] = run.pictures.size();
  out["checkpoint"] =
      checkpoint.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(checkpoint);
  out["bytes"] = bytes_in(run.path);
  return json_text(out);
}

}  // namespace archetide
