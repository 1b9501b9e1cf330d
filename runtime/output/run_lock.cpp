#include "runtime/output/run_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/base/input_error.h"

namespace archetide {

RunLock::RunLock(const std::string& folder) {
  if (folder.empty()) throw InputError("the name of the run folder is empty", "say -o DIR");
  std::error_code problem;
  const bool is_file =
      std::filesystem::exists(folder, problem) && !std::filesystem::is_directory(folder, problem);
  if (is_file) throw InputError(folder + " is not a folder", "choose another -o DIR");
  std::filesystem::create_directories(folder, problem);
  if (problem) throw MachineError(folder + ": cannot be made: " + problem.message());
  descriptor_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0) throw MachineError(folder + ": cannot be opened: " + std::strerror(errno));
  // Some network file systems lock no folders: there the user has to take care.
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor_);
  throw InputError(folder + ": another run writes into this folder now",
                   "wait for it, stop it, or choose another -o DIR");
}

RunLock::~RunLock() { ::close(descriptor_); }

}  // namespace archetide
