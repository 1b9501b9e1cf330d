#pragma once

#include <limits>
#include <string>
#include <vector>

#include "runtime/output/csv.h"
#include "runtime/output/run_folder.h"
#include "tests/bench/frame_costs.h"
#include "tests/bench/paper/paper_scenes.h"

namespace archetide {

enum class PaperState { kNotRun, kUnfinished, kDone, kFailed };

/// What one run came to; NaN: not known.
struct PaperFigures {
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  double seconds = kUnknown, worst_seconds = kUnknown;        // wall, of the steps of a frame
  double iterations = kUnknown, worst_iterations = kUnknown;  // of a coupled solve
  double steps = kUnknown, halvings = kUnknown;
  double cpu_seconds = kUnknown;  // of a frame, everything
  double bytes = kUnknown;        // most memory of the process
  double volume = kUnknown;       // largest change of what surface and drops show, of all water
  double kept = kUnknown;         // the same with the water that cells hold out of sight
  double energy = kUnknown;       // most above its start and the work, of the largest in motion
  double regained = kUnknown;     // most above what it was before, less the work, of the same
  double unmatched = kUnknown;    // largest momentum of `unmatched`, of the largest of everything
  double rest = kUnknown;         // largest momentum that the budget leaves over, of the same
  double overlap = kUnknown;      // deepest, cells
  double deformation = kUnknown;  // largest, of the body's size
};

/// The paper's figure and our run of it.
struct PaperRun {
  PaperScene scene;
  PaperState state = PaperState::kNotRun;
  std::string reason;  // why it failed
  RunFolder folder;    // this and the tables only when there is a manifest
  CsvTable stats, bodies;
  FrameCosts costs;  // by frame
  PaperFigures figures;
};

/// Of the run folder OUT/NAME. A scene that was refused before it ran has OUT/NAME.refused instead.
PaperRun read_paper_run(const std::string& out, const PaperScene& scene);

/// Curves by rows of stats.csv.
/// Change of the water that surface and drops show (`all`: and that cells hold out of sight), of
/// that of the first row.
std::vector<double> volume_change(const CsvTable& stats, bool all);
/// Energy above that of the start and the work of actuators, J; bodies that appear bring theirs.
std::vector<double> energy_gain(const CsvTable& stats);
/// Norm of the momentum of the columns NAMEx, NAMEy, NAMEz, kg m/s.
std::vector<double> norms(const CsvTable& stats, const std::string& name);

}  // namespace archetide
