#include "runtime/output/run_writer.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/atomic_file.h"
#include "runtime/output/body_surface.h"
#include "runtime/output/manifest.h"
#include "runtime/output/ply.h"
#include "runtime/output/progress.h"
#include "runtime/output/run_description.h"
#include "runtime/output/run_folder.h"
#include "runtime/output/run_tables.h"
#include "runtime/output/vtp.h"
#include "runtime/output/water_surface.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// The manifest comes first, so that the folder is seen to hold a run whenever this one ends.
std::string make_folders(const std::string& directory, const Manifest* first) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw MachineError(directory + ": cannot be made: " + error.message());
  if (first) write_manifest(directory + "/manifest.json", *first);
  fs::create_directories(fs::path(directory) / "frames", error);
  if (error) throw MachineError(directory + ": cannot be made: " + error.message());
  fs::remove(fs::path(directory) / "done.stamp", error);
  return directory + '/';
}

void check_frame_kinds(const std::vector<std::string>& kinds) {
  for (const std::string& kind : kinds) {
    const auto& known = frame_kinds();
    if (std::find(known.begin(), known.end(), kind) != known.end()) continue;
    const std::string near = closest_match(kind, known);
    throw InputError(
        "output.frames: this version writes no \"" + kind + '"',
        near.empty() ? "it writes surface.ply, bodies.vtp, particles.vtp, markers.vtp and spray.vtp"
                     : "did you mean \"" + near + "\"?");
  }
}

std::string frame_file(const std::string& stem, int frame, const std::string& extension) {
  char number[16];
  std::snprintf(number, sizeof number, ".%06d.", frame);
  return stem + number + extension;
}

}  // namespace

const std::vector<std::string>& frame_kinds() {
  static const std::vector<std::string> kinds = {"surface.ply", "bodies.vtp", "particles.vtp",
                                                 "markers.vtp", "spray.vtp"};
  return kinds;
}

struct RunWriter::Impl {
  RunSetup setup;
  Manifest manifest;
  std::string folder;  // with the final '/'
  Progress progress;
  StatsTable stats;
  BodiesTable bodies;
  GaugesTable gauges;
  PvdIndex surface_pvd, bodies_pvd, particles_pvd, markers_pvd, spray_pvd;

  // Since the last frame line, and since the start.
  Clock::time_point run_start = Clock::now(), frame_start = Clock::now();
  double start_time = 0.0;  // scene time at the start, s
  int frame_steps = 0, frame_iterations = 0;
  double frame_residual = 0.0;
  StepReport last;
  double first_volume = std::nan("");             // m^3
  double seconds_before = 0.0, cpu_before = 0.0;  // s, before it was resumed
  double peak_before = 0.0;                       // bytes
  std::map<std::string, double> phases_before;    // s
  int last_late = 0;                              // bodies that waited for a free place
  std::map<int, double> last_held;                // s, when a body was held (InversionGuard)
  std::map<Refusal, int> refused;                 // steps, why and how often
  double last_incompatible = -INFINITY;           // s, when closed water could not take a flow
  double last_thrown = -INFINITY;                 // s, when bodies gained energy from nothing

  Impl(RunSetup s, const Simulation& simulation)
      : setup(std::move(s)),
        manifest(describe_run(setup, simulation)),
        folder(make_folders(setup.directory, goes_on() ? nullptr : &manifest)),
        progress(folder + "run.log", setup.quiet, goes_on()),
        stats(folder + "stats.csv", goes_on()),
        bodies(folder + "bodies.csv", simulation.all_bodies(), goes_on()),
        gauges(folder + "gauges.csv", setup.gauges, goes_on()),
        surface_pvd(folder + "frames/surface.pvd"),
        bodies_pvd(folder + "frames/bodies.pvd"),
        particles_pvd(folder + "frames/particles.pvd"),
        markers_pvd(folder + "frames/markers.pvd"),
        spray_pvd(folder + "frames/spray.pvd"),
        start_time(simulation.time()) {
    if (setup.resumed) resume();
    write_file_atomically(folder + "scene.toml", setup.scene_text);
    write_manifest(folder + "manifest.json", manifest);
    write_obstacles(simulation);
    show_header(simulation);
    if (setup.resumed) progress.line("resumed    from " + setup.resumed_from);
  }

  bool goes_on() const { return setup.resumed && !setup.fork; }

  // Counters of the checkpoint; in the same folder, tables and frames as they were then.
  void resume() {
    const RunProgress& p = *setup.resumed;
    manifest.frames = p.frames, manifest.steps = p.steps, manifest.halvings = p.halvings;
    manifest.worst_iterations = p.worst_iterations;
    manifest.worst_volume_drift = p.worst_volume_drift;
    first_volume = p.first_volume;
    if (!goes_on()) return;
    stats.resume(p.stats_rows);
    bodies.resume(p.bodies_rows);
    gauges.resume(p.stats_rows);
    remove_frames_from(setup.directory, p.frames);
    for (PvdIndex* pvd : {&surface_pvd, &bodies_pvd, &particles_pvd, &markers_pvd, &spray_pvd})
      pvd->resume(p.frames);
    const Manifest before = read_manifest(folder + "manifest.json");
    manifest.started = before.started;
    seconds_before = before.wall_seconds, cpu_before = before.cpu_seconds;
    peak_before = before.peak_bytes, phases_before = before.phase_seconds;
  }

  // A line when a body's modes are stopped, none while it stays or comes back within a frame.
  void tell_held(const StepReport& report, const Simulation& simulation) {
    for (const int b : report.held_bodies) {
      const auto [when, first] = last_held.try_emplace(b, report.t);
      if (first || report.t - when->second > 1.0 / setup.fps)
        progress.line(
            fmt::format("t = {:f} s: {} is held where its elements would turn inside out or "
                        "stretch beyond its modes",
                        report.t, name_of(b, simulation)));
      when->second = report.t;
    }
  }

  // Water closed in, into which more flows than a thousandth of a cell a step: where it goes is
  // not physics. A line at most once a frame.
  void tell_incompatible(const StepReport& report, double cell_volume) {
    const double flow = report.velocity.incompatible_flow;
    if (flow * report.dt <= 1e-3 * cell_volume) return;
    if (report.t - last_incompatible > 1.0 / setup.fps)
      progress.line(
          fmt::format("t = {:f} s: {} m^3/s flow into water that is closed in and cannot take it",
                      report.t, number_text(flow)));
    last_incompatible = report.t;
  }

  // A line at most once a frame.
  void tell_thrown(const StepReport& report) {
    if (!report.thrown) return;
    if (report.t - last_thrown > 1.0 / setup.fps)
      progress.line(
          fmt::format("t = {:f} s: bodies gain energy from nothing, {:.3g} m/s, although the step "
                      "was halved {} times",
                      report.t, report.max_speed, report.halvings));
    last_thrown = report.t;
  }

  // A line when more bodies come to wait than waited before.
  void tell_late(double t, int late) {
    if (late > last_late)
      progress.line(fmt::format(
          "t = {:f} s: {} bodies wait to appear: another one stands in the place", t, late));
    last_late = late;
  }

  std::string name_of(int b, const Simulation& simulation) const {
    const auto n = static_cast<std::size_t>(b);
    return n < setup.body_names.size() ? setup.body_names[n]
                                       : simulation.bodies()[n].archetype->name;
  }

  bool wants(const std::string& kind) const {
    return std::find(setup.frames.begin(), setup.frames.end(), kind) != setup.frames.end();
  }

  void show_header(const Simulation& simulation) {
    for (const std::string& line : header_lines(setup, manifest, simulation)) progress.line(line);
  }

  // Static obstacles do not move: one file for the whole run.
  void write_obstacles(const Simulation& simulation) const {
    SurfaceMesh all;
    for (const TriMesh& obstacle : simulation.obstacles()) {
      const int first = static_cast<int>(all.vertices.size());
      std::vector<Vec3> normals;
      std::vector<double> areas;
      vertex_normals_and_areas(obstacle, normals, areas);
      all.vertices.insert(all.vertices.end(), obstacle.vertices.begin(), obstacle.vertices.end());
      all.normals.insert(all.normals.end(), normals.begin(), normals.end());
      for (const Vec3i& t : obstacle.triangles) all.triangles.push_back(t + Vec3i::Constant(first));
    }
    if (!all.triangles.empty()) write_ply(folder + "frames/obstacles.ply", all);
  }

  void write_frame_files(const Simulation& simulation) {
    const double t = simulation.time();
    const int frame = manifest.frames;
    const FluidState& fluid = simulation.fluid();
    const bool has_surface = simulation.options().has_water && fluid.phi.size() > 0;
    if (wants("surface.ply") && has_surface) {
      const std::string name = frame_file("surface", frame, "ply");
      write_ply(folder + "frames/" + name, water_surface(simulation.grid(), fluid.phi));
      surface_pvd.add(t, name);
    }
    if (wants("bodies.vtp") && !simulation.bodies().empty()) {
      const std::string name = frame_file("bodies", frame, "vtp");
      write_vtp(folder + "frames/" + name, bodies_surface(simulation.bodies(), simulation.skins()),
                t);
      bodies_pvd.add(t, name);
    }
    if (wants("particles.vtp") && fluid.particles.size() > 0) {
      const std::string name = frame_file("particles", frame, "vtp");
      write_particles_vtp(folder + "frames/" + name, fluid.particles, t);
      particles_pvd.add(t, name);
    }
    if (wants("markers.vtp") && !fluid.markers.empty()) {
      const std::string name = frame_file("markers", frame, "vtp");
      std::vector<Vec3> velocity;
      for (const Vec3& x : fluid.markers)
        velocity.push_back(interpolate(simulation.grid(), fluid.u, x));
      write_markers_vtp(folder + "frames/" + name, fluid.markers, velocity, t);
      markers_pvd.add(t, name);
    }
    if (wants("spray.vtp") && fluid.spray.size() > 0) {
      const std::string name = frame_file("spray", frame, "vtp");
      write_spray_vtp(folder + "frames/" + name, fluid.spray, t);
      spray_pvd.add(t, name);
    }
  }

  void write_rows(Simulation& simulation) {
    for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
      const int body = static_cast<int>(b);
      bodies.add(simulation.time(), body, simulation.bodies()[b], simulation.water_impulse(body),
                 simulation.water_angular_impulse(body));
    }
    simulation.reset_water_impulses();
    bodies.flush();
    flush_steps();
  }

  // The tables that have a row a step.
  void flush_steps() {
    stats.flush();
    gauges.flush();
  }

  double volume_drift() const {
    return std::isnan(first_volume) ? 0.0 : last.volume_drift(first_volume);
  }

  void show_frame(double t) {
    const double elapsed = seconds_since(run_start), done = t - start_time;
    const double left =
        done > 0.0 ? elapsed * std::max(0.0, setup.end_time - t) / done : std::nan("");
    char text[256];
    std::snprintf(text, sizeof text,
                  "frame %d  t %.3f s  steps %d  iterations %d  residual %.1e  volume %+.3f %%  "
                  "speed %.2f m/s  %.2f s/frame  left %s",
                  manifest.frames, t, frame_steps, frame_iterations, frame_residual,
                  100.0 * volume_drift(), last.max_speed, seconds_since(frame_start),
                  duration_text(left).c_str());
    progress.frame_line(text);
  }

  void start_next_frame() {
    ++manifest.frames;
    frame_steps = frame_iterations = 0;
    frame_residual = 0.0;
    frame_start = Clock::now();
  }

  void fill_totals(const Simulation& simulation) {
    manifest.time = simulation.time();
    manifest.finished = utc_now();
    manifest.wall_seconds = seconds_before + seconds_since(run_start);
    manifest.cpu_seconds = cpu_before + process_cpu_seconds();
    manifest.peak_bytes = std::max(peak_before, process_peak_bytes());
    manifest.phase_seconds = phases_before;
    for (const std::string& phase : simulation.profile().phases())
      manifest.phase_seconds[phase] += simulation.profile().seconds(phase);
  }

  void show_summary(const Profile& profile) {
    for (const std::string& line : summary_lines(manifest, profile, refused)) progress.line(line);
  }

  void finish(int exit_code, const std::string& reason, const Simulation& simulation) {
    flush_steps();
    bodies.flush();
    fill_totals(simulation);
    manifest.exit = exit_code;
    manifest.reason = reason;
    show_summary(simulation.profile());
    if (!reason.empty()) progress.line(reason);
    write_manifest(folder + "manifest.json", manifest);
  }

  void write_stamp() { write_file_atomically(folder + "done.stamp", manifest.finished + '\n'); }
};

RunWriter::RunWriter(RunSetup setup, const Simulation& simulation) {
  check_frame_kinds(setup.frames);
  impl_ = std::make_unique<Impl>(std::move(setup), simulation);
}

RunWriter::~RunWriter() = default;

void RunWriter::on_step(const StepReport& report, const Simulation& simulation) {
  Impl& d = *impl_;
  d.stats.add(report, simulation.profile());
  d.gauges.add(report, simulation);
  d.last = report;
  if (std::isnan(d.first_volume)) d.first_volume = std::max(report.accounted_volume(), 0.0);

  d.tell_held(report, simulation);
  d.tell_late(report.t, simulation.late_bodies());
  d.tell_thrown(report);
  d.tell_incompatible(report, std::pow(simulation.options().grid.dx, 3));

  const int iterations = std::max(report.position.iterations, report.velocity.iterations);
  const double residual = std::max(report.position.residual, report.velocity.residual);
  ++d.frame_steps;
  d.frame_iterations = std::max(d.frame_iterations, iterations);
  d.frame_residual = std::max(d.frame_residual, residual);

  Manifest& m = d.manifest;
  ++m.steps;
  m.halvings += report.halvings;
  for (const Refusal why : report.refused) ++d.refused[why];
  m.worst_iterations = std::max(m.worst_iterations, iterations);
  if (std::abs(d.volume_drift()) > std::abs(m.worst_volume_drift))
    m.worst_volume_drift = d.volume_drift();
}

void RunWriter::on_frame(Simulation& simulation) {
  impl_->write_frame_files(simulation);
  impl_->write_rows(simulation);
  impl_->show_frame(simulation.time());
  impl_->start_next_frame();
}

void RunWriter::finish(int exit_code, const std::string& reason, const Simulation& simulation) {
  if (simulation.late_bodies() > 0)
    log(fmt::format(
        "note       {} bodies have not appeared: another one stood in the place to the end",
        simulation.late_bodies()));
  impl_->finish(exit_code, reason, simulation);
  if (exit_code == kExitDone) impl_->write_stamp();
}

void RunWriter::finish_part(const std::string& reason, const Simulation& simulation) {
  impl_->finish(kExitDone, reason, simulation);
}

void RunWriter::add_closed_form(const Manifest::ClosedFormEntry& entry) {
  impl_->manifest.closed_forms.push_back(entry);
}

int RunWriter::frame() const { return impl_->manifest.frames - 1; }

RunProgress RunWriter::progress() {
  impl_->flush_steps();
  impl_->bodies.flush();
  const Manifest& m = impl_->manifest;
  return {m.frames,
          m.steps,
          m.halvings,
          m.worst_iterations,
          m.worst_volume_drift,
          impl_->first_volume,
          impl_->stats.rows(),
          impl_->bodies.rows()};
}

void RunProgress::visit_state(StateArchive& a) {
  a.field("run/frames", frames);
  a.field("run/steps", steps);
  a.field("run/halvings", halvings);
  a.field("run/worst_iterations", worst_iterations);
  a.field("run/worst_volume_drift", worst_volume_drift);
  a.field("run/first_volume", first_volume);
  a.field("run/stats_rows", stats_rows);
  a.field("run/bodies_rows", bodies_rows);
}

void RunWriter::log(const std::string& line) { impl_->progress.line(line); }

}  // namespace archetide
