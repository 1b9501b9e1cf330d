#include "runtime/commands/claim_run_folder.h"

#include <filesystem>
#include <optional>

namespace archetide {
namespace {

namespace fs = std::filesystem;

bool is_frame(const std::string& text) {
  return !text.empty() && text.size() <= 9 &&
         text.find_first_not_of("0123456789") == std::string::npos;
}

// The word about the last checkpoint goes first and the manifest last: a program killed between the
// two leaves a run without a checkpoint, never one that goes on from files which are gone. Parts of
// files go with them: without a manifest they would be files of a stranger.
void clear_run_folder(const std::string& folder) {
  for (const char* name : {"checkpoint/LATEST", "done.stamp", "scene.toml", "run.log", "stats.csv",
                           "bodies.csv", "gauges.csv", "frames", "pictures", "failure",
                           "checkpoint", "film.mp4", "report.html", "manifest.json"}) {
    fs::remove_all(fs::path(folder) / (name + std::string(".part")));
    fs::remove_all(fs::path(folder) / name);
  }
}

// True when the folder holds a run. Throws InputError when it holds anything else. A run begins
// with its manifest: one that was killed before has left nothing but that file's part.
bool holds_run(const std::string& out) {
  if (fs::exists(fs::path(out) / "manifest.json")) return true;
  for (const fs::directory_entry& entry : fs::directory_iterator(out)) {
    if (entry.path().filename() != "manifest.json.part")
      throw InputError(out + " holds files that are no run of this program",
                       "choose another -o DIR");
  }
  return false;
}

// The checkpoint that --resume auto and --replace together go on from: none that is missing,
// damaged or of another scene.
std::optional<std::string> usable_checkpoint(const std::string& out,
                                             const CheckpointIdentity& identity) {
  try {
    const auto latest = latest_checkpoint(out);
    return latest && state_fits(*latest, identity) ? latest : std::nullopt;
  } catch (const FileError&) {
    return std::nullopt;
  }
}

// `auto` in a folder with a run: an unfinished one of this scene goes on.
RunStart resume_automatically(const Arguments& a, const CheckpointIdentity& identity) {
  const bool done = fs::exists(fs::path(a.out) / "done.stamp");
  const bool either = a.replace && !a.resume.empty();  // both given: resume where possible
  std::optional<std::string> latest;
  if (!done && either) latest = usable_checkpoint(a.out, identity);
  if (!done && !a.replace) latest = latest_checkpoint(a.out);
  if (latest) return {*latest, false};
  if (!a.replace)
    throw InputError(
        a.out + (done ? " holds a run already" : " holds an unfinished run without a checkpoint"),
        "use --replace to run again in its place");
  clear_run_folder(a.out);
  return {};
}

}  // namespace

RunStart claim_run_folder(const Arguments& a, const CheckpointIdentity& identity) {
  const bool automatic = a.resume.empty() || a.resume == "auto", fork = a.resume.ends_with(".h5");
  if (!automatic && !fork && a.resume != "never" && !is_frame(a.resume))
    throw InputError("--resume " + a.resume + " is neither auto, never, a frame nor a file .h5",
                     "for example --resume 144");
  const bool held = holds_run(a.out);
  if (is_frame(a.resume)) return {checkpoint_of_frame(a.out, std::stoi(a.resume)), false};
  if (held && automatic) return resume_automatically(a, identity);
  if (held && !a.replace)
    throw InputError(a.out + " holds a run already", "use --replace to run again in its place");
  if (held) clear_run_folder(a.out);
  return fork ? RunStart{a.resume, true} : RunStart{};
}

}  // namespace archetide
