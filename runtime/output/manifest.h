#pragma once

#include <map>
#include <string>
#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// manifest.json: what ran, with what, and how it ended.
struct Manifest {
  struct ArchetypeEntry {
    std::string name, hash;  // content hash, hex
    int surface_vertices = 0, modes = 0;
    double bytes = 0.0;  // of the arrays in memory, B
  };
  struct BodyEntry {
    std::string name, archetype;
    double mass = 0.0;     // kg
    double density = 0.0;  // kg/m^3
    int modes = 0;         // in use
    double bytes = 0.0;    // of the instance, B
  };

  /// What a quantity of [expect] came to, next to its closed form.
  struct ClosedFormEntry {
    std::string key;
    double value = 0.0, exact = 0.0, size = 0.0;  // m; size of the body
  };

  // What ran.
  std::string version, build;  // of the program; compiler and flags
  std::string scene, scene_hash, command_line;
  int threads = 1;
  Grid grid;  // zero cells: no tank
  bool has_water = false;
  double fps = 24.0, end_time = 0.0;  // 1/s, s
  std::vector<ArchetypeEntry> archetypes;
  std::vector<BodyEntry> bodies;

  // How it went; exit is -1 while the run goes on.
  std::string started, finished;  // UTC, ISO 8601
  int exit = -1;
  std::string reason;
  int frames = 0, steps = 0, halvings = 0, worst_iterations = 0;
  double time = 0.0;                // scene time reached, s
  double worst_volume_drift = 0.0;  // relative to the water after the first step
  double wall_seconds = 0.0, cpu_seconds = 0.0, peak_bytes = 0.0;
  std::map<std::string, double> phase_seconds;
  std::vector<ClosedFormEntry> closed_forms;
};

/// Compiler, optimisation and instruction set of this build.
std::string build_description();
/// Now, UTC, ISO 8601.
std::string utc_now();
double process_cpu_seconds();
double process_peak_bytes();

/// Atomic; throws MachineError.
void write_manifest(const std::string& path, const Manifest& manifest);
/// Throws FileError: missing, or not a manifest.
Manifest read_manifest(const std::string& path);

}  // namespace archetide
