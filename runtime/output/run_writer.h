#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/gauge.h"
#include "runtime/output/manifest.h"
#include "runtime/simulation.h"

namespace archetide {

/// How far a run has come: what a resumed one goes on from.
struct RunProgress {
  int frames = 0, steps = 0, halvings = 0, worst_iterations = 0;
  double worst_volume_drift = 0.0;
  double first_volume = std::numeric_limits<double>::quiet_NaN();  // m^3; NaN: no step yet
  std::int64_t stats_rows = 0, bodies_rows = 0;                    // in this folder's tables
  void visit_state(StateArchive& a);
};

/// What a run is called and what it leaves behind.
struct RunSetup {
  std::string directory;  // created if missing
  std::string scene_name;
  std::string scene_text;    // TOML of exactly what ran, becomes scene.toml
  std::string command_line;  // recorded, may be empty
  double end_time = 0.0;     // s, for the estimate of the time left
  double fps = 24.0;         // frames per second of scene time
  std::vector<std::string> frames = {"surface.ply", "bodies.vtp"};  // subset of frame_kinds()
  std::vector<Gauge> gauges;
  std::vector<std::string> body_names;  // one per body, or empty: the archetype's name
  std::vector<std::string> notes = {};  // lines of the run's header
  int threads = 1;
  bool quiet = false;  // no progress on stderr (run.log is always written)
  /// From a checkpoint: goes on in the same folder (tables and frames are cut to it), or, `fork`,
  /// begins a folder of its own.
  std::optional<RunProgress> resumed;
  std::string resumed_from;  // its file
  bool fork = false;
};

/// The frame files that a scene may ask for: surface.ply, bodies.vtp, particles.vtp,
/// markers.vtp.
const std::vector<std::string>& frame_kinds();

/// Bytes of the arrays of a run with these fields and these bodies, an estimate before it starts.
struct MemoryEstimate {
  double water = 0.0;       // B, grid arrays, multigrid, particles
  double bodies = 0.0;      // B, all instances
  double archetypes = 0.0;  // B, each shared archetype once
  double total() const { return water + bodies + archetypes; }
};
/// Bytes of one archetype's arrays, B.
double archetype_bytes(const Archetype& archetype);
MemoryEstimate estimate_memory(const SimulationOptions& options, const Grid& fields,
                               const std::vector<ReducedBody>& bodies);
/// ", 3.1 GiB once a splash reaches the lid": fields grow with the height of the water. Empty when
/// they are as high as the tank.
std::string memory_at_the_lid(const SimulationOptions& options, const Grid& fields,
                              const std::vector<ReducedBody>& bodies);

/// Writes a run folder while the run goes on: scene.toml, manifest.json, run.log, stats.csv,
/// bodies.csv, gauges.csv, frames/*, and done.stamp last. Every complete file appears whole (X.part, sync,
/// rename); the CSV files and the log grow. Progress goes to stderr.
///
///   RunWriter out(setup, simulation);
///   out.on_frame(simulation);                      // frame 0 is the initial state
///   out.on_step(simulation.step(dt), simulation);  // each step
///   out.on_frame(simulation);                      // each frame
///   out.finish(exit_code, reason, simulation);
class RunWriter {
 public:
  /// Throws MachineError when the folder cannot be written, InputError for an unknown frame kind.
  RunWriter(RunSetup setup, const Simulation& simulation);
  ~RunWriter();
  RunWriter(const RunWriter&) = delete;
  RunWriter& operator=(const RunWriter&) = delete;

  /// A row of stats.csv, and of gauges.csv if there are gauges.
  void on_step(const StepReport& report, const Simulation& simulation);
  /// Rows of bodies.csv and the frame's files; then restarts the simulation's water impulses.
  void on_frame(Simulation& simulation);
  /// Summary and the final manifest; done.stamp only when exit_code is 0. `reason` may be empty.
  void finish(int exit_code, const std::string& reason, const Simulation& simulation);
  /// The same of a run that was to go only so far: exit code 0, but no done.stamp.
  void finish_part(const std::string& reason, const Simulation& simulation);
  /// Into the manifest of finish().
  void add_closed_form(const Manifest::ClosedFormEntry& entry);
  /// Number of the frame that was written last, -1: none.
  int frame() const;
  /// How far it is now; the tables are flushed.
  RunProgress progress();
  /// A line of run.log, and of stderr unless quiet.
  void log(const std::string& line);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
