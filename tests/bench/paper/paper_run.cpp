#include "tests/bench/paper/paper_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double v : values) most = std::max(most, std::abs(v));
  return most;
}

double mean_of_frames(const std::vector<double>& values) {
  double sum = 0.0;
  for (std::size_t f = 1; f < values.size(); ++f) sum += values[f];  // frame 0 is the start
  return values.size() > 1 ? sum / static_cast<double>(values.size() - 1) : PaperFigures::kUnknown;
}

// From a value to a later one.
double largest_rise(const std::vector<double>& values) {
  double lowest = INFINITY, rise = 0.0;
  for (const double v : values) lowest = std::min(lowest, v), rise = std::max(rise, v - lowest);
  return rise;
}

// Row by row.
std::vector<double> sum_of(const CsvTable& stats, std::initializer_list<std::string> names) {
  std::vector<double> sum(stats.rows(), 0.0);
  for (const std::string& name : names) {
    const std::vector<double>& column = column_of(stats, name);
    for (std::size_t n = 0; n < sum.size(); ++n) sum[n] += column[n];
  }
  return sum;
}

// When a body is first seen, s, but for those of the start.
std::vector<double> appearances(const CsvTable& bodies) {
  const std::vector<double>&t = bodies.column("t"), &body = bodies.column("body");
  std::vector<double> times;
  double most = -1.0;
  for (std::size_t n = 0; n < t.size(); ++n) {
    if (body[n] > most && t[n] > t.front()) times.push_back(t[n]);
    most = std::max(most, body[n]);
  }
  return times;
}

// Change of p beyond what the budget has booked. Bodies that appear bring theirs: the frames around
// that are left out.
double momentum_left_over(const CsvTable& stats, const CsvTable& bodies, double frame) {
  const std::vector<double>&t = column_of(stats, "t"), new_ones = appearances(bodies);
  const auto brings = [&](double time) {
    return std::any_of(new_ones.begin(), new_ones.end(),
                       [&](double a) { return std::abs(time - a) < 1.01 * frame; });
  };
  double most = 0.0;
  for (const std::string axis : {"x", "y", "z"}) {
    const std::vector<double>& p = column_of(stats, "p" + axis);
    const std::vector<double> booked =
        sum_of(stats, {"transported_p" + axis, "solid_p" + axis, "weight_p" + axis,
                       "contact_p" + axis, "unmatched_p" + axis});
    double left = 0.0;
    for (std::size_t n = 1; n < t.size(); ++n) {
      if (!brings(t[n])) left += p[n] - p[n - 1] - (booked[n] - booked[n - 1]);
      most = std::max(most, std::abs(left));
    }
  }
  return most;
}

// stats has at least one row.
PaperFigures figures_of(const PaperRun& run) {
  const Manifest& m = run.folder.manifest;
  const CsvTable& stats = run.stats;
  PaperFigures f;
  f.seconds = mean_of_frames(run.costs.seconds), f.worst_seconds = largest(run.costs.seconds);
  f.iterations = mean_of_frames(run.costs.iterations);
  f.worst_iterations = std::max(largest(column_of(stats, "iterations")),
                                largest(column_of(stats, "iterations_position")));
  f.steps = static_cast<double>(stats.rows()), f.halvings = 0.0;
  for (const double halvings : column_of(stats, "halvings")) f.halvings += halvings;
  if (m.frames > 1) {  // written at the end of a run
    f.cpu_seconds = m.cpu_seconds / (m.frames - 1);
    f.bytes = m.peak_bytes;
  }
  f.volume = largest(volume_change(stats, false)), f.kept = largest(volume_change(stats, true));
  const std::vector<double> gain = energy_gain(stats);
  const double moving =
      std::max(largest(sum_of(stats, {"water_kinetic", "body_kinetic", "body_elastic"})), 1e-300);
  f.energy = std::max(0.0, *std::max_element(gain.begin(), gain.end())) / moving;
  f.regained = largest_rise(gain) / moving;
  const double momentum = std::max(largest(norms(stats, "p")), 1e-300);
  f.unmatched = largest(norms(stats, "unmatched_p")) / momentum;
  f.rest = momentum_left_over(stats, run.bodies, 1.0 / m.fps) / momentum;
  f.overlap = largest(column_of(stats, "max_penetration")) / m.grid.dx;
  f.deformation = largest(column_of(stats, "max_deformation"));
  return f;
}

PaperState state_of(const RunFolder& folder) {
  if (fs::exists(folder.path + "done.stamp")) return PaperState::kDone;
  const int exit = folder.manifest.exit;
  const bool failed = exit > kExitDone && exit != kExitStopped;
  return failed ? PaperState::kFailed : PaperState::kUnfinished;
}

std::vector<double> frame_times(const Manifest& m, const CsvTable& stats) {
  std::vector<double> times;
  const double end = stats.column("t").back();  // of an unfinished run the manifest counts none
  constexpr double kSameTime = 1e-9;            // s
  for (int f = 0; f / m.fps <= end + kSameTime; ++f) times.push_back(f / m.fps);
  return times;
}

}  // namespace

std::vector<double> volume_change(const CsvTable& stats, bool all) {
  std::vector<double> volume = sum_of(stats, {"water_volume", "spray_volume", "outflow_volume"});
  const std::vector<double>& hidden = column_of(stats, "volume_residual");
  for (std::size_t n = 0; n < volume.size(); ++n) volume[n] += all ? hidden[n] : 0.0;
  const double first = volume.empty() ? 0.0 : volume.front();
  for (double& v : volume) v = first > 0.0 ? v / first - 1.0 : 0.0;
  return volume;
}

std::vector<double> energy_gain(const CsvTable& stats) {
  return sum_of(stats, {"transported_kinetic", "contact_energy", "drag_energy", "slowed_energy",
                        "held_energy", "solved_energy"});
}

std::vector<double> norms(const CsvTable& stats, const std::string& name) {
  std::vector<double> norm(stats.rows(), 0.0);
  for (const char* axis : {"x", "y", "z"}) {
    const std::vector<double>& column = column_of(stats, name + axis);
    for (std::size_t n = 0; n < norm.size(); ++n) norm[n] = std::hypot(norm[n], column[n]);
  }
  return norm;
}

PaperRun read_paper_run(const std::string& out, const PaperScene& scene) {
  PaperRun run;
  run.scene = scene;
  const std::string folder = out + '/' + scene.name, refusal = folder + ".refused";
  if (fs::exists(refusal)) {
    run.state = PaperState::kFailed;
    run.reason = read_whole_file(refusal);
    return run;
  }
  if (!fs::exists(folder + "/manifest.json")) return run;
  run.folder = open_run_folder(folder);
  run.state = state_of(run.folder);
  run.reason = run.folder.manifest.reason;
  if (fs::exists(folder + "/stats.csv")) run.stats = read_csv(folder + "/stats.csv");
  if (fs::exists(folder + "/bodies.csv")) run.bodies = read_csv(folder + "/bodies.csv");
  if (run.stats.rows() == 0) return run;
  run.costs = frame_costs(run.stats, frame_times(run.folder.manifest, run.stats));
  run.figures = figures_of(run);
  return run;
}

}  // namespace archetide
