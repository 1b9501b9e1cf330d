#pragma once

#include <map>
#include <string>
#include <vector>

#include "runtime/output/manifest.h"
#include "runtime/output/run_writer.h"

namespace archetide {

/// What is known of a run before its first step.
Manifest describe_run(const RunSetup& setup, const Simulation& simulation);

/// "drag 0.5 1/s, beaches", or "none".
std::string damping_text(const Damping& damping);

/// "torus 752 of 6024": the triangles that the water meets of each archetype and skin that it does
/// not meet by all of them.
std::vector<std::string> coarser_surfaces(const std::vector<ReducedBody>& bodies,
                                          const std::vector<SkinnedBodies>& skins);

/// The lines that a run begins with: grid, bodies, what is on, memory.
std::vector<std::string> header_lines(const RunSetup& setup, const Manifest& manifest,
                                      const Simulation& simulation);

/// The lines that it ends with: time by phase, worst drift, halvings, worst iteration count, and
/// what steps were `refused` for, how often since the program began.
std::vector<std::string> summary_lines(const Manifest& manifest, const Profile& profile,
                                       const std::map<Refusal, int>& refused);

}  // namespace archetide
