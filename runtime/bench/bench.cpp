#include "runtime/bench/bench.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/base/sha256.h"
#include "common/params/cli.h"
#include "runtime/bench/child_run.h"
#include "runtime/output/csv.h"
#include "runtime/output/manifest.h"
#include "runtime/scene/archetype_library.h"
#include "runtime/scene/parse_scene.h"
#include "runtime/scene/scene_builder.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

bool overrides_key(const std::vector<std::string>& overrides, const std::string& key) {
  return std::any_of(overrides.begin(), overrides.end(),
                     [&](const std::string& word) { return word.starts_with(key + '='); });
}

// The value as it stands in the sweep, or itself.
std::string value_in(const Sweep& sweep, const std::string& value) {
  const auto same = [&](const std::string& other) {
    return other == value || sweep_number(other) == sweep_number(value);
  };
  const auto found = std::find_if(sweep.values.begin(), sweep.values.end(), same);
  return found == sweep.values.end() ? value : *found;
}

std::string point_text(const std::vector<Sweep>& sweeps, const SweepPoint& point) {
  std::string text;
  for (std::size_t s = 0; s < sweeps.size(); ++s)
    text += (s ? " " : "") + sweeps[s].key + '=' + point.values[s];
  return text;
}

// One bench while it goes on.
class Bench {
 public:
  Bench(const BenchRequest& request, const volatile std::sig_atomic_t& stop)
      : request_(request), stop_(stop), overrides_(request.overrides) {
    for (const std::string& text : request.sweeps) sweeps_.push_back(parse_sweep(text));
    // No frame files: they can be switched on by --set.
    bool frames = overrides_key(overrides_, "output.frames");
    for (const Sweep& sweep : sweeps_) frames = frames || sweep.key == "output.frames";
    if (!frames) overrides_.push_back("output.frames=[]");
    base_ = parse_scene(request.scene, overrides_);
    const bool keep_grid = overrides_key(request.overrides, "fluid.grid");
    points_ = sweep_points(sweeps_, base_, keep_grid);
    reference_ = bench_reference(request.references, sweeps_, base_, keep_grid);
    ArchetypeLibrary library(base_.directory, request.archetypes);
    build_scene(base_, library);
    for (const SweepPoint& point : points_) scene_of(point);  // wrong values before any run
    for (const Sweep& sweep : sweeps_) table_.keys.push_back(sweep.key);
    table_.scene = base_.name;
  }

  BenchTable run() {
    fs::create_directories(fs::path(request_.out) / "points");
    if (reference_.point) run_reference();
    for (std::size_t n = 0; n < points_.size() && !stop_; ++n) {
      const bool is_reference = reference_.point && points_[n].values == reference_.point->values;
      if (!is_reference) table_.rows.push_back(row_of(points_[n], place(n)));
    }
    compare();
    return table_;
  }

 private:
  std::string place(std::size_t n) const {
    return fmt::format("point {} of {}", n + 1, points_.size());
  }
  SceneSpec scene_of(const SweepPoint& point) const {
    std::vector<std::string> all = overrides_;
    all.insert(all.end(), point.overrides.begin(), point.overrides.end());
    return parse_scene(request_.scene, all);
  }
  std::string folder_of(const SweepPoint& point) const {
    return request_.out + "/points/" + point.name;
  }
  double end_of(const SceneSpec& scene) const {
    return std::min(scene.end_time, request_.until.value_or(scene.end_time));
  }

  void run_reference() {
    reference_.folder = folder_of(*reference_.point);
    BenchRow row = row_of(*reference_.point, "reference");
    row.reference = !row.failed;
    if (row.failed) reference_.folder.clear();
    table_.rows.push_back(row);
  }

  // A run of this scene, by this program, with these threads, that reached its end and is younger
  // than the files that it read.
  bool is_there(const SweepPoint& point, const SceneSpec& scene) const {
    const fs::path file = fs::path(folder_of(point)) / "manifest.json";
    if (!fs::exists(file)) return false;
    const Manifest m = read_manifest(file.string());
    if (m.scene_hash != sha256_hex(scene.text) || m.version != ARCHETIDE_VERSION ||
        m.build != build_description() || !reached_end(m, scene))
      return false;
    if (request_.threads > 0 && m.threads != request_.threads) return false;
    const ArchetypeLibrary library(scene.directory, request_.archetypes);
    for (const std::string& read : scene_dependencies(scene, library))
      if (read != scene.file && fs::last_write_time(read) > fs::last_write_time(file)) return false;
    return true;
  }

  bool reached_end(const Manifest& m, const SceneSpec& scene) const {
    const bool ended = m.exit == kExitDone || m.exit == kExitNumerics || m.exit == kExitStopped;
    return ended && m.time >= end_of(scene) * (1.0 - 1e-9);
  }

  std::vector<std::string> command(const SweepPoint& point) const {
    std::vector<std::string> words = {
        request_.program, "run",   request_.scene, "-o", folder_of(point),
        "--resume",       "never", "--replace",    "-q"};
    const auto add = [&](const std::string& option, const std::string& value) {
      words.push_back(option), words.push_back(value);
    };
    if (!request_.archetypes.empty()) add("--archetypes", request_.archetypes);
    if (request_.threads > 0) add("-t", std::to_string(request_.threads));
    if (request_.until) add("--until", number_text(*request_.until));
    for (const std::string& word : overrides_) add("--set", word);
    for (const std::string& word : point.overrides) add("--set", word);
    return words;
  }

  BenchRow row_of(const SweepPoint& point, const std::string& name) const {
    const SceneSpec scene = scene_of(point);
    BenchRow row = empty_bench_row(point.values);
    if (is_there(point, scene)) {
      log_info(name + ": " + point_text(sweeps_, point) + ": there already");
    } else {
      log_info(name + ": " + point_text(sweeps_, point));
      const ChildEnd end = run_child(command(point), folder_of(point) + ".log", stop_);
      row.cpu_seconds = end.cpu_seconds, row.wall_seconds = end.wall_seconds;
      row.peak_bytes = end.peak_bytes;
      if (end.signal > 0)
        row.status = fmt::format("failed: signal {}", end.signal);
      else if (end.exit != kExitDone)
        row.status = fmt::format("failed: exit {}, see {}.log", end.exit, point.name);
    }
    judge(point, scene, row);
    return row;
  }

  // Fills the row from the run's own files; `status` stands already when the process failed.
  void judge(const SweepPoint& point, const SceneSpec& scene, BenchRow& row) const {
    const std::string folder = folder_of(point);
    row.failed = row.status != "done";
    if (!fs::exists(folder + "/manifest.json")) return;
    const Manifest m = read_manifest(folder + "/manifest.json");
    if (m.exit < 0 || m.scene_hash != sha256_hex(scene.text)) return;  // died on the way
    row.cpu_seconds = m.cpu_seconds, row.wall_seconds = m.wall_seconds;
    row.peak_bytes = m.peak_bytes;
    row.steps = m.steps, row.iterations_max = m.worst_iterations;
    const CsvTable stats = read_csv(folder + "/stats.csv");
    row.iterations_total = 0.0;
    for (const char* column : {"iterations", "iterations_position"})
      for (const double count : stats.column(column)) row.iterations_total += count;
    row.failed = !reached_end(m, scene);
    if (row.failed)
      row.status = m.exit == kExitStopped ? "interrupted" : "failed: " + m.reason;
    else
      row.status = m.exit == kExitNumerics ? "done, misses [expect]" : "done";
    for (const auto& c : m.closed_forms) {
      const double off = std::abs(c.value - c.exact) / c.size;
      row.closed_form = std::isnan(row.closed_form) ? off : std::max(row.closed_form, off);
    }
  }

  void compare() {
    const bool has_reference = !reference_.folder.empty();
    const bool bodies = !base_.bodies.empty() || !base_.scatters.empty();
    table_.against = reference_.text;
    table_.measure = reference_.point && !has_reference ? "none, the reference failed"
                     : !has_reference ? "distance from the closed form / body size"
                     : bodies         ? "position, rms / body size"
                                      : "kinetic energy, rms / its largest";
    for (std::size_t n = 0; n < table_.rows.size(); ++n) {
      BenchRow& row = table_.rows[n];
      const SweepPoint point =
          sweep_point(sweeps_, row.values, base_, overrides_key(request_.overrides, "fluid.grid"));
      if (!row.failed && has_reference)
        row.difference = run_difference(folder_of(point), reference_.folder);
      if (!row.failed)
        row.error = !has_reference ? row.closed_form
                    : bodies       ? row.difference.position
                                   : row.difference.kinetic;
    }
    mark_pareto(table_.rows);
    std::vector<double> numbers;
    const std::size_t axis = order_axis();
    for (const BenchRow& row : table_.rows) numbers.push_back(sweep_number(row.values[axis]));
    fill_orders(table_.rows, axis, numbers);
  }

  // The first key whose values are numbers.
  std::size_t order_axis() const {
    for (std::size_t s = 0; s < sweeps_.size(); ++s)
      if (std::isfinite(sweep_number(sweeps_[s].values[0]))) return s;
    return 0;
  }

  const BenchRequest& request_;
  const volatile std::sig_atomic_t& stop_;
  std::vector<std::string> overrides_;
  std::vector<Sweep> sweeps_;
  SceneSpec base_;
  std::vector<SweepPoint> points_;
  BenchReference reference_;
  BenchTable table_;
};

bool has_closed_forms(const SceneSpec& scene) {
  return std::any_of(scene.expect.bodies.begin(), scene.expect.bodies.end(),
                     [](const BodyExpectation& b) { return b.z || b.draft; });
}

}  // namespace

BenchReference bench_reference(const std::vector<std::string>& references,
                               const std::vector<Sweep>& sweeps, const SceneSpec& base,
                               bool keep_grid) {
  BenchReference reference;
  if (references.empty() && has_closed_forms(base)) return reference;
  if (references.size() == 1 && fs::is_directory(references[0])) {
    read_manifest(references[0] + "/manifest.json");  // throws when it is no run
    reference.folder = reference.text = references[0];
    return reference;
  }
  std::vector<std::string> values;
  for (const Sweep& sweep : sweeps) values.push_back(sweep.values.back());
  for (const std::string& word : references) {
    const std::size_t equals = word.find('=');
    const std::string key = equals == std::string::npos ? sweeps[0].key : word.substr(0, equals);
    const auto sweep =
        std::find_if(sweeps.begin(), sweeps.end(), [&](const Sweep& s) { return s.key == key; });
    if (sweep == sweeps.end())
      throw InputError("--reference " + word + ": " + key + " is not swept",
                       "give a value of " + sweeps[0].key +
                           ", key=value of a swept key, or the "
                           "folder of a finished run");
    values[sweep - sweeps.begin()] =
        value_in(*sweep, equals == std::string::npos ? word : word.substr(equals + 1));
  }
  reference.point = sweep_point(sweeps, values, base, keep_grid);
  reference.text = point_text(sweeps, *reference.point);
  return reference;
}

BenchTable run_bench(const BenchRequest& request, const volatile std::sig_atomic_t& stop) {
  Bench bench(request, stop);
  const BenchTable table = bench.run();
  write_bench_csv(request.out + "/bench.csv", table);
  if (!request.csv.empty()) write_bench_csv(request.csv, table);
  return table;
}

std::string bench_help() {
  return "Every point is a run in a process of its own, in DIR/points/; the table goes to stdout "
         "and to\nDIR/bench.csv. A point that is there already, of the same scene and program, is "
         "not run again.\nA value of fluid.cell brings the fluid.grid that keeps the tank (an edge "
         "of one cell stays one).\nWithout --set output.frames=... no frames are written.\n\n"
         "Errors are root mean squares over the frames that both runs have, and over all bodies:\n"
         "  position          of centres of mass / cube root of the body's volume\n"
         "  rotation          angle between both, rad\n"
         "  modal             |q - q_ref| / rms of |q_ref|\n"
         "  momentum          of water and bodies / its largest value in the reference\n"
         "  angular_momentum  of the bodies, likewise\n"
         "  volume            of the water / its first value\n"
         "  kinetic           energy of water and bodies / its largest value\n"
         "  closed_form       largest distance from a closed form of [expect] / body size\n"
         "The headline `error` is closed_form when that is the reference, else position, or "
         "kinetic\n"
         "without bodies. `front` marks points that no other one beats in both error and CPU "
         "seconds;\n`order` is log(error ratio) / |log(value ratio)| to the point before.\n\n";
}

}  // namespace archetide
