#include "common/base/byte_stream.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "common/base/input_error.h"

namespace archetide {
namespace {

/// Only files that end: a pipe may never open, a device may never stop.
const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

/// An open file of the system, closed with this object.
class OpenFile {
 public:
  explicit OpenFile(const std::string& path)
      : path_(path), descriptor_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    if (descriptor_ < 0) fail("cannot be opened");
    struct stat found {};
    if (::fstat(descriptor_, &found) != 0) fail("cannot be read");
    if (!S_ISREG(found.st_mode)) {
      ::close(descriptor_);
      throw FileError(path_ + ": is " + kind_of(found.st_mode) +
                      ", not a file; copy what it holds into a file");
    }
  }
  ~OpenFile() { ::close(descriptor_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  /// Up to `room` bytes; 0 at the end.
  std::size_t read(char* to, std::size_t room) const {
    for (;;) {
      const ssize_t count = ::read(descriptor_, to, room);
      if (count >= 0) return static_cast<std::size_t>(count);
      if (errno != EINTR) throw FileError(path_ + ": cannot be read: " + std::strerror(errno));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const std::string reason = std::strerror(errno);
    if (descriptor_ >= 0) ::close(descriptor_);
    throw FileError(path_ + ": " + what + ": " + reason);
  }

  std::string path_;
  int descriptor_ = -1;
};

}  // namespace

void read_file_in_blocks(const std::string& path,
                         const std::function<void(std::string_view)>& take) {
  const OpenFile file(path);
  std::string block(1 << 16, '\0');
  while (const std::size_t count = file.read(block.data(), block.size()))
    take(std::string_view(block).substr(0, count));
}

std::string read_whole_file(const std::string& path) {
  std::string bytes;
  read_file_in_blocks(path, [&](std::string_view block) { bytes += block; });
  return bytes;
}

}  // namespace archetide
