#include "runtime/output/checkpoint.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

const std::string kFormat = "archetide checkpoint";
constexpr int kVersion = 13;
const std::string kStopped = "stopped.h5";

std::string folder_of(const std::string& run_folder) {
  return (fs::path(run_folder) / "checkpoint").string();
}

std::string file_name(int frame) {
  char name[24];
  std::snprintf(name, sizeof name, "%06d.h5", frame);
  return name;
}

bool is_checkpoint(const std::string& name) {
  return name.size() == 9 && name.ends_with(".h5") && name.find_first_not_of("0123456789") == 6;
}

// Checkpoints in a folder, the oldest first.
std::vector<std::string> checkpoints_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (is_checkpoint(entry.path().filename().string()))
      names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string others(const std::string& folder, const std::string& but) {
  std::string list;
  for (const std::string& name : checkpoints_in(folder))
    if (name != but) list += fmt::format("{}{}", list.empty() ? "" : ", ", std::stoi(name));
  return list;
}

// What to do about a file that cannot be used.
std::string advice_for(const std::string& path) {
  const fs::path file(path);
  const std::string rest = others(file.parent_path().string(), file.filename().string());
  return (rest.empty() ? std::string()
                       : "go on from another frame with --resume (" + rest + "), or ") +
         "start again with --resume never --replace";
}

}  // namespace

CheckpointIdentity checkpoint_identity(const std::string& scene_text,
                                       const std::vector<ReducedBody>& bodies,
                                       const std::vector<SkinnedBodies>& skins) {
  CheckpointIdentity identity{sha256_hex(scene_text), ""};
  for (const ReducedBody& body : bodies) identity.archetypes += body.archetype->content_hash + '\n';
  for (const SkinnedBodies& skin : skins)
    identity.archetypes += skin.shape->skin->content_hash + '\n';
  return identity;
}

Checkpoints::Checkpoints(const std::string& run_folder, CheckpointIdentity identity, int keep)
    : folder_(folder_of(run_folder)), identity_(std::move(identity)), keep_(keep) {}

std::string Checkpoints::write(const std::string& name, const VisitState& visit) const {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw MachineError(folder_ + ": cannot be made: " + error.message());
  const std::string path = folder_ + '/' + name;
  write_state(path, identity_, visit);
  write_file_atomically(folder_ + "/LATEST", name + '\n');
  return path;
}

std::string Checkpoints::write(int frame, const VisitState& visit) const {
  const std::string path = write(file_name(frame), visit);
  std::error_code ignored;
  fs::remove(folder_ + '/' + kStopped, ignored);
  const std::vector<std::string> names = checkpoints_in(folder_);
  for (std::size_t n = 0; n + static_cast<std::size_t>(keep_) < names.size(); ++n)
    fs::remove(folder_ + '/' + names[n], ignored);
  return path;
}

std::string Checkpoints::write_stopped(const VisitState& visit) const {
  return write(kStopped, visit);
}

std::optional<std::string> latest_checkpoint(const std::string& run_folder) {
  const std::string latest = folder_of(run_folder) + "/LATEST";
  if (!fs::exists(latest)) return std::nullopt;
  std::string name = read_whole_file(latest);
  name.erase(std::remove(name.begin(), name.end(), '\n'), name.end());
  const std::string path = folder_of(run_folder) + '/' + name;
  if (name.empty() || name.find('/') != std::string::npos || !fs::exists(path))
    throw FileError(latest + ": names no checkpoint that is there (\"" + name + "\"); " +
                    advice_for(path));
  return path;
}

std::string checkpoint_of_frame(const std::string& run_folder, int frame) {
  const std::string path = folder_of(run_folder) + '/' + file_name(frame);
  if (fs::exists(path)) return path;
  const std::string there = others(folder_of(run_folder), "");
  const bool stopped = fs::exists(folder_of(run_folder) + '/' + kStopped);
  throw FileError(path + ": no such file; " +
                  (!there.empty() ? "there are frames " + there
                   : stopped      ? "there is only " + kStopped + ", for --resume auto"
                                  : "the run has no checkpoints"));
}

void write_state(const std::string& path, const CheckpointIdentity& identity,
                 const VisitState& visit) {
  StateWriter file(path, kFormat, kVersion);
  CheckpointIdentity id = identity;
  file.field("scene_hash", id.scene_hash);
  file.field("archetypes", id.archetypes);
  visit(file);
  file.commit();
}

bool state_fits(const std::string& path, const CheckpointIdentity& identity) {
  try {
    StateReader file(path, kFormat, kVersion, "");
    CheckpointIdentity found;
    file.field("scene_hash", found.scene_hash);
    file.field("archetypes", found.archetypes);
    return found.scene_hash == identity.scene_hash && found.archetypes == identity.archetypes;
  } catch (const FileError&) {
    return false;
  }
}

void read_state(const std::string& path, const CheckpointIdentity& identity, bool same_scene,
                const VisitState& visit) {
  StateReader file(path, kFormat, kVersion, advice_for(path));
  CheckpointIdentity found;
  file.field("scene_hash", found.scene_hash);
  file.field("archetypes", found.archetypes);
  if (same_scene && found.scene_hash != identity.scene_hash)
    file.fail("the scene is not the one of this run (its hash differs)");
  if (found.archetypes != identity.archetypes)
    file.fail("bodies or archetypes are not those of this run (their hashes differ)");
  visit(file);
  file.demand_hash();
}

}  // namespace archetide
