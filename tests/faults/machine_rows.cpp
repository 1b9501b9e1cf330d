// Disks that are full or cannot be written, memory that runs out.

#include <fmt/core.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "common/base/input_error.h"
#include "tests/faults/workshop.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

const char* const kNoRight = "skipped: needs the right to mount (root)";

// A disk of its own for this process and its children, as long as it lives.
class SmallDisk {
 public:
  explicit SmallDisk(std::string folder) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    good_ = ::unshare(CLONE_NEWNS) == 0 &&
            ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 && resize("1m", true);
  }
  ~SmallDisk() {
    if (good_) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool good() const { return good_; }
  bool resize(const std::string& size, bool first = false) const {
    const unsigned long flags = first ? 0 : MS_REMOUNT;
    return ::mount("tmpfs", folder_.c_str(), "tmpfs", flags, ("size=" + size).c_str()) == 0;
  }
  bool read_only(bool on) const {
    return ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT | (on ? MS_RDONLY : 0), nullptr) ==
           0;
  }

 private:
  std::string folder_;
  bool good_ = false;
};

// The disk is full a little later each time, so at every file in turn; then it is not.
std::string full_disk(Workshop& w, double share, std::string& figures) {
  const SmallDisk disk(w / "disk");
  if (!disk.good()) return figures = kNoRight, "";
  const int count = std::max(4, static_cast<int>(40 * share));
  int full = 0;
  for (int n = 0; n < count; ++n) {
    fs::remove_all(w / "disk/r");
    const int kilobytes = 4 * (1 + n * 500 / count);
    if (!disk.resize(fmt::format("{}k", kilobytes))) return "the disk cannot be resized";
    const Ending end = run(w.run_into("disk/r"));
    if (end.code != 0 && end.code != kExitMachine) return wrong_code(end, "0 or 5");
    if (end.code == kExitMachine && end.text.empty()) return "no message about a full disk";
    full += end.code == kExitMachine;
    disk.resize("64m");
    const Ending again = run(w.run_into("disk/r"));
    if (again.code != 0) return wrong_code(again, "0 with room");
    if (const std::string wrong = w.difference("disk/r"); !wrong.empty())
      return fmt::format("{} kB: {}", kilobytes, wrong);
  }
  figures = fmt::format("{} of {} sizes were too small", full, count);
  return "";
}

std::string full_disk_for_builds(Workshop& w, double share, std::string& figures) {
  const SmallDisk disk(w / "disk");
  if (!disk.good()) return figures = kNoRight, "";
  const int count = std::max(2, static_cast<int>(10 * share));
  int full = 0;
  for (int n = 0; n < count; ++n) {
    disk.resize(fmt::format("{}k", 4 * (1 + n * 20 / count)));
    fs::remove(w / "disk/ball.h5");
    const Ending end = run(w.build_into("disk/ball.h5"));
    if (end.code != 0 && end.code != kExitMachine) return wrong_code(end, "0 or 5");
    full += end.code == kExitMachine;
    if (end.code == kExitMachine && fs::exists(w / "disk/ball.h5"))
      return "half an archetype is there";
    disk.resize("64m");
    if (const Ending again = run(w.build_into("disk/ball.h5")); again.code != 0)
      return wrong_code(again, "0 with room");
    if (const std::string wrong = w.build_difference("disk/ball.h5"); !wrong.empty()) return wrong;
  }
  figures = fmt::format("{} of {} sizes were too small", full, count);
  return "";
}

std::string read_only_disk(Workshop& w, double, std::string& figures) {
  const SmallDisk disk(w / "disk");
  if (!disk.good()) return figures = kNoRight, "";
  disk.read_only(true);
  for (const Command& c : {w.run_into("disk/r"), w.build_into("disk/ball.h5")}) {
    const Ending end = run(c);
    if (end.code != kExitMachine) return wrong_code(end, "5");
  }
  figures = "run and build";
  return "";
}

// As somebody who may read nothing here, or write nothing.
std::string no_permission(Workshop& w, double, std::string& figures) {
  if (::getuid() != 0) return figures = "skipped: needs root, to become nobody", "";
  const auto become_nobody = [] {
    constexpr uid_t kNobody = 65534;
    if (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0) ::_exit(126);
  };
  Command writes = w.run_into("r_nobody"), reads = w.run_into("r_secret");
  writes.before = reads.before = become_nobody;
  const Ending cannot_write = run(writes);
  if (cannot_write.code != kExitMachine) return wrong_code(cannot_write, "5");
  fs::copy_file(w / "tank.scene.toml", w / "secret.scene.toml",
                fs::copy_options::overwrite_existing);
  ::chmod((w / "secret.scene.toml").c_str(), 0);
  reads.words[2] = "secret.scene.toml";
  const Ending cannot_read = run(reads);
  if (cannot_read.code != kExitFile) return wrong_code(cannot_read, "4");
  figures = "folder and scene";
  return "";
}

// Too little even for the libraries: the loader says so, or OpenBLAS, which has no room for the stack
// of a thread, ends the process before main() begins.
bool never_began(const Ending& end) {
  constexpr int kLoader = 127;
  return end.code == kLoader ||
         (end.code == -SIGINT && end.text.find("blas_thread_init") != std::string::npos);
}

// Address space from nearly nothing on.
std::string little_memory(Command c, double low, double high, int count, std::string& figures) {
  int failed = 0;
  for (int n = 0; n < count; ++n) {
    const auto bytes = static_cast<rlim_t>((low + (high - low) * n / count) * (1 << 20));
    c.before = [bytes] {
      const rlimit limit{bytes, bytes};
      ::setrlimit(RLIMIT_AS, &limit);
    };
    const Ending end = run(c);
    const bool wrong = end.timed_out || (end.code != 0 && end.code != kExitMachine &&
                                         end.code != kExitInput && !never_began(end));
    if (wrong) return fmt::format("{} MB: {}", bytes >> 20, wrong_code(end, "0 or 5"));
    failed += end.code != 0;
  }
  figures = fmt::format("{} of {} limits were too low", failed, count);
  return "";
}

std::string little_memory_for_runs(Workshop& w, double share, std::string& figures) {
  Command c = w.run_into("r_memory", {"--frames", "2"});
  return little_memory(c, 60, 200, std::max(4, static_cast<int>(40 * share)), figures);
}

std::string little_memory_for_builds(Workshop& w, double share, std::string& figures) {
  return little_memory(w.build_into("memory.h5"), 150, 450,
                       std::max(4, static_cast<int>(30 * share)), figures);
}

}  // namespace

const std::vector<Row>& machine_rows() {
  static const std::vector<Row> rows = {
      {"disk-full-run", "a disk that is full at every file of a run in turn: 5, then bit-equal",
       full_disk},
      {"disk-full-build", "the same of a build", full_disk_for_builds},
      {"read-only", "a disk that cannot be written: 5", read_only_disk},
      {"permission", "a folder that may not be written: 5; a scene that may not be read: 4",
       no_permission},
      {"memory-run", "address space of 60 to 200 MB for a run: 5 or done", little_memory_for_runs},
      {"memory-build", "address space of 150 to 450 MB for a build: 5 or done",
       little_memory_for_builds}};
  return rows;
}

}  // namespace archetide
