#pragma once

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "runtime/output/csv.h"

#ifdef ARCHETIDE_PRECOMPUTE_BIN

namespace archetide {

/// A folder of its own in which the programs build bodies of the assets and run a scene with them;
/// gone with this.
class SceneFolder {
 public:
  explicit SceneFolder(const std::string& name)
      : folder_(fmt::format("{}scene_{}{}", testing::TempDir(), name, ::getpid())) {
    std::filesystem::create_directories(folder_);
  }
  ~SceneFolder() { std::filesystem::remove_all(folder_); }
  SceneFolder(const SceneFolder&) = delete;
  SceneFolder& operator=(const SceneFolder&) = delete;

  const std::string& path() const { return folder_; }
  /// Bodies by their names, one or more words; the exit code of the first that fails, or 0.
  int build(const std::string& bodies) const {
    std::istringstream words(bodies);
    for (std::string name; words >> name;) {
      const int code = shell(ARCHETIDE_PRECOMPUTE_BIN " build " ARCHETIDE_ASSETS "/bodies/" + name +
                             ".body.toml -o " + folder_ + "/" + name + ".h5");
      if (code != 0) return code;
    }
    return 0;
  }
  /// On one thread; exit code.
  int run(const std::string& scene, const std::string& settings = "") const {
    return shell(fmt::format("{} run {} -q -t 1 --archetypes {} -o {}/run {}", ARCHETIDE_SIM_BIN,
                             scene, folder_, folder_, settings));
  }
  CsvTable table(const std::string& name) const { return read_csv(folder_ + "/run/" + name); }

 private:
  static int shell(const std::string& command) {
    const int status = std::system((command + " >/dev/null").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  std::string folder_;
};

inline double largest(const std::vector<double>& values) {
  return *std::max_element(values.begin(), values.end());
}

/// Of the values above the lowest before them, from the one `first` on.
inline double largest_rise(const std::vector<double>& values, std::size_t first = 0) {
  double lowest = INFINITY, rise = 0.0;
  for (std::size_t n = first; n < values.size(); ++n) {
    lowest = std::min(lowest, values[n]);
    rise = std::max(rise, values[n] - lowest);
  }
  return rise;
}

}  // namespace archetide

#endif
