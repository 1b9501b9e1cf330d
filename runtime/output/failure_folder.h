#pragma once

#include <string>
#include <vector>

#include "runtime/failure.h"
#include "runtime/output/checkpoint.h"
#include "runtime/simulation.h"

namespace archetide {

/// What DIR/failure is written from.
struct FailureSetup {
  std::string run_folder;
  std::string scene_text;  // with paths that hold from anywhere
  std::string options;     // of the command line that matter: --archetypes .., -t .., --frames ..
  std::vector<std::string> body_names, joint_names;
};

/// "joint 0 is [[joint]] 1, body 3 is left, body 4 is right"; "" where nothing is known.
std::string culprit_names(const Culprit& culprit, const FailureSetup& setup);

/// Writes DIR/failure: diagnosis.txt and .json, scene.toml, state.h5 (what `visit` lists, now),
/// start.h5 (the run's last checkpoint, if there is one), the offending bodies' and the water's
/// surface, and the command that runs from start.h5, or from the beginning, into the same failure.
/// Returns that command.
std::string write_failure(const FailureSetup& setup, const SimulationFailure& failure,
                          const CheckpointIdentity& identity, const Simulation& simulation,
                          const VisitState& visit);

}  // namespace archetide
