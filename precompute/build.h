#pragma once

#include <string>

#include "common/archetype/archetype.h"
#include "common/base/profile.h"
#include "precompute/base/build_record.h"
#include "precompute/intake/intake.h"
#include "precompute/recipe.h"

namespace archetide {

/// The tets of a body and what was done to get them.
struct BodyMesh {
  TriMesh surface;   // accepted input, m; empty when the input is a tet mesh
  TetMesh tets;      // in metres, coordinates of the input mesh times scale
  TetGroups groups;  // of the input, when it is a tet mesh
  TetQuality quality;
  std::string mesher;   // cgal | gmsh | input
  IntakeReport intake;  // empty when the input is a tet mesh
};

/// Recipe -> tets: reads the mesh, accepts or refuses it, fills it, applies the quality gate.
/// Phases read, intake and mesh go to `profile`.
BodyMesh mesh_body(const Recipe& recipe, Profile& profile);

/// Recipe -> archetype: the whole of the precompute except writing the file. `record` (if any) gets
/// the peak memory after each step and what intake found.
Archetype build_archetype(const Recipe& recipe, Profile& profile, BuildRecord* record = nullptr);

/// Seconds by phase and their sum, in one line.
std::string phase_table(const Profile& profile);

/// A make fragment: `target` depends on the body file, its mesh, and the body files of a skin's
/// parts. Throws InputError for names that make cannot handle.
std::string depfile_text(const std::string& target, const Recipe& recipe);

}  // namespace archetide
