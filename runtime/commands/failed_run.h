#pragma once

#include <string>
#include <vector>

#include "runtime/commands/command.h"
#include "runtime/output/failure_folder.h"
#include "runtime/output/run_writer.h"
#include "runtime/scene/archetype_library.h"

namespace archetide {

/// What a run that fails writes beside its state, for a replay from anywhere.
FailureSetup failure_setup(const SceneSpec& scene, const Arguments& a,
                           const ArchetypeLibrary& library,
                           const std::vector<std::string>& body_names,
                           const std::vector<std::string>& joint_names);

/// Writes the failure folder and ends the run's own; returns the exit code.
int finish_broken_run(const SimulationFailure& failure, const FailureSetup& setup,
                      const CheckpointIdentity& identity, const Simulation& simulation,
                      const VisitState& visit, bool quiet, RunWriter& writer);

}  // namespace archetide
