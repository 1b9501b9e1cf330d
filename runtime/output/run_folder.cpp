#include "runtime/output/run_folder.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "common/base/input_error.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

// The number in "stem.000012.ext", -1 for other names.
int frame_number(const std::string& name, const std::string& stem, const std::string& extension) {
  if (name.size() != stem.size() + extension.size() + 8 || name.rfind(stem + '.', 0) != 0 ||
      !name.ends_with('.' + extension))
    return -1;
  const std::string digits = name.substr(stem.size() + 1, 6);
  const bool all_digits = digits.find_first_not_of("0123456789") == std::string::npos;
  return all_digits ? std::stoi(digits) : -1;
}

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

RunFolder open_run_folder(const std::string& directory) {
  RunFolder run;
  run.path = directory + '/';
  if (!fs::is_directory(directory)) throw FileError(directory + ": no such folder");
  if (!fs::exists(run.path + "manifest.json"))
    throw FileError(directory + ": not a run folder (it has no manifest.json)");
  run.manifest = read_manifest(run.path + "manifest.json");

  std::map<int, FrameFiles> frames;
  for (const std::string& name : names_in(run.path + "frames")) {
    if (const int n = frame_number(name, "surface", "ply"); n >= 0)
      frames[n].surface = run.path + "frames/" + name;
    if (const int n = frame_number(name, "bodies", "vtp"); n >= 0)
      frames[n].bodies = run.path + "frames/" + name;
    if (const int n = frame_number(name, "markers", "vtp"); n >= 0)
      frames[n].markers = run.path + "frames/" + name;
    if (const int n = frame_number(name, "spray", "vtp"); n >= 0)
      frames[n].spray = run.path + "frames/" + name;
  }
  for (auto& [number, files] : frames) {
    files.number = number;
    run.frames.push_back(files);
  }
  for (const std::string& name : names_in(run.path + "pictures"))
    if (frame_number(name, "frame", "png") >= 0)
      run.pictures.push_back(run.path + "pictures/" + name);
  return run;
}

void remove_frames_from(const std::string& directory, int first) {
  for (const std::string& name : names_in(directory + "/frames")) {
    const std::size_t dot = name.find('.');
    const std::size_t last = name.rfind('.');
    if (dot == last || dot == std::string::npos) continue;
    const int number = frame_number(name, name.substr(0, dot), name.substr(last + 1));
    std::error_code error;
    if (number >= first) fs::remove(directory + "/frames/" + name, error);
  }
}

}  // namespace archetide
