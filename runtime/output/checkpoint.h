#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/files/state_file.h"
#include "runtime/articulation/skinning.h"

namespace archetide {

/// What a checkpoint belongs to.
struct CheckpointIdentity {
  std::string scene_hash;  // SHA-256 of scene.toml
  std::string archetypes;  // content hashes, one of each body, then of each skin, joined
};
CheckpointIdentity checkpoint_identity(const std::string& scene_text,
                                       const std::vector<ReducedBody>& bodies,
                                       const std::vector<SkinnedBodies>& skins = {});

/// Lists everything that a run is made of, for both directions.
using VisitState = std::function<void(StateArchive&)>;

/// DIR/checkpoint/NNNNNN.h5, of frames, stopped.h5, of a run that was stopped between two, until
/// there is a later one; and LATEST, the name of the last of them.
class Checkpoints {
 public:
  /// Keeps the last `keep` of frames.
  Checkpoints(const std::string& run_folder, CheckpointIdentity identity, int keep);

  /// Atomic; returns the path. Throws MachineError.
  std::string write(int frame, const VisitState& visit) const;
  /// Of a run that stops between two frames; the same.
  std::string write_stopped(const VisitState& visit) const;

 private:
  std::string write(const std::string& name, const VisitState& visit) const;

  std::string folder_;
  CheckpointIdentity identity_;
  int keep_;
};

/// The file that LATEST names, or nothing when there is no LATEST. Throws FileError when LATEST
/// names nothing.
std::optional<std::string> latest_checkpoint(const std::string& run_folder);
/// The file of one frame. Throws FileError when it is not there, and says which are.
std::string checkpoint_of_frame(const std::string& run_folder, int frame);

/// Writes one state, anywhere. Atomic.
void write_state(const std::string& path, const CheckpointIdentity& identity,
                 const VisitState& visit);
/// Whether a state is of this scene and these archetypes; false for damaged files.
bool state_fits(const std::string& path, const CheckpointIdentity& identity);
/// Reads a state into what `visit` lists. Throws FileError: missing, damaged, of another version,
/// other archetypes, or (`same_scene`) another scene. What `visit` lists is undefined then.
void read_state(const std::string& path, const CheckpointIdentity& identity, bool same_scene,
                const VisitState& visit);

}  // namespace archetide
