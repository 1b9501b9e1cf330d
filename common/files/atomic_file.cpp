#include "common/files/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/base/input_error.h"

namespace archetide {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& action) {
  throw MachineError(path + ": " + action + ": " + std::strerror(errno));
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

void sync_to_disk(const std::string& path, int open_flags) {
  const int descriptor = ::open(path.c_str(), open_flags);
  if (descriptor < 0) fail(path, "cannot be opened to be synced");
  const int failed = ::fsync(descriptor);
  const int reason = errno;
  ::close(descriptor);
  // Some file systems cannot sync a folder and say so with EINVAL.
  if (failed && reason != EINVAL) {
    errno = reason;
    fail(path, "cannot be synced to the disk");
  }
}

/// Only files are replaced: a device or a pipe would be gone, and a part that is none may never
/// take what is written.
void demand_file_or_nothing(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) {
    if (errno != ENOENT) fail(path, "cannot be written");
    return;
  }
  if (S_ISREG(found.st_mode)) return;
  throw MachineError(path + ": cannot be written: it is " +
                     (S_ISDIR(found.st_mode) ? "a folder" : "a device or a pipe, not a file") +
                     "; choose another name");
}

}  // namespace

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), part_(path_ + ".part") {
  if (path_.empty()) throw InputError("the name of a file to write is empty", "say -o FILE");
  const std::string folder = folder_of(path_);
  if (::access(folder.c_str(), W_OK | X_OK) != 0) fail(path_, "cannot be written to " + folder);
  demand_file_or_nothing(path_);
  demand_file_or_nothing(part_);
}

AtomicFile::~AtomicFile() {
  if (!committed_) std::remove(part_.c_str());
}

void AtomicFile::commit() {
  sync_to_disk(part_, O_RDONLY);
  if (std::rename(part_.c_str(), path_.c_str()) != 0) fail(path_, "cannot be replaced");
  committed_ = true;
  sync_to_disk(folder_of(path_), O_RDONLY | O_DIRECTORY);
}

void make_folder_of(const std::string& path) {
  std::error_code ignored;
  std::filesystem::create_directories(folder_of(path), ignored);
}

void write_file_atomically(const std::string& path, std::string_view bytes) {
  AtomicFile file(path);
  std::ofstream out(file.part(), std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) fail(path, "write failed");
  file.commit();
}

}  // namespace archetide
