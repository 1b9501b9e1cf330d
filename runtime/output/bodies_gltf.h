#pragma once

#include <optional>
#include <string>
#include <vector>

#include "runtime/output/run_folder.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

struct BodiesGltf {
  std::string bytes;  // of the .glb file
  int bodies = 0, meshes = 0, frames = 0;
  /// Largest distance of a vertex from the bodies.*.vtp of the last frame, m; empty: none to compare
  /// with, or bodies under a skin. Bodies of nodes are shown by their stored modes.
  std::optional<double> off;
};

/// The bodies of a run as an animated glTF scene, y up. A node each, with the name of the scene;
/// instances of an archetype share its surface, whose modes are morph targets: what the largest and the
/// lowest amplitude of the run move, in m, with weights from 0 to 1. Translation, rotation and scale
/// are those of (S2), so that the shape is that of the run. Skins are shown as the bodies
/// under them. A body that is not there yet has scale 0. Frames `first` .. `last` (< 0: to the end).
/// `bodies`: those of the manifest, with their modes, anywhere. Throws FileError: bodies.csv is damaged,
/// no such frame.
BodiesGltf bodies_gltf(const RunFolder& run, std::vector<ReducedBody> bodies, int first, int last);

}  // namespace archetide
