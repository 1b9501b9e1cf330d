#pragma once

#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace archetide {

/// A folder of its own that goes away with the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    static int count = 0;
    path_ = (std::filesystem::temp_directory_path() /
             fmt::format("archetide_output_{}_{}", getpid(), count++))
                .string();
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::string& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ + '/' + name; }

 private:
  std::string path_;
};

}  // namespace archetide
