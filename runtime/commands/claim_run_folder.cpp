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

void clear_run_folder(const std::string& folder) {
  for (const char* name :
       {"done.stamp", "scene.toml", "run.log", "stats.csv", "bodies.csv", "frames", "pictures",
        "failure", "checkpoint", "film.mp4", "report.html", "manifest.json"}) {
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

// `auto` in a folder with a run: an unfinished one of this scene goes on.
RunStart resume_automatically(const Arguments& a, const CheckpointIdentity& identity) {
  const bool done = fs::exists(fs::path(a.out) / "done.stamp");
  const bool either = a.replace && !a.resume.empty();  // both given: resume where possible
  const auto latest = done || (a.replace && !either) ? std::nullopt : latest_checkpoint(a.out);
  if (latest && (!either || state_fits(*latest, identity))) return {*latest, false};
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
