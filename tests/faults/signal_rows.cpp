// Signals that end other programs, and two runs at once.

#include <fmt/core.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "common/base/input_error.h"
#include "tests/faults/workshop.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

std::string finish(Workshop& w, const std::string& out) {
  const Ending end = run(w.run_into(out));
  return end.code == 0 ? w.difference(out) : wrong_code(end, "0");
}

// Sent at any moment: stopped with a checkpoint, or done; goes on to the same result.
std::string stop_by(int signal, Workshop& w, double share, std::string& figures) {
  const int count = std::max(2, static_cast<int>(20 * share));
  int stopped = 0;
  for (int n = 0; n < count; ++n) {
    fs::remove_all(w / "r");
    Command c = w.run_into("r");
    c.before = [] { ::signal(SIGHUP, SIG_DFL); };  // nohup has it ignored
    const pid_t child = start(c, w / "log");
    // Before main() has begun, and the manifest says so, nobody may be listening.
    std::this_thread::sleep_for(std::chrono::duration<double>(w.uniform(0.05, w.run_seconds())));
    ::kill(child, signal);
    const Ending end = wait_for(child, 60.0, w / "log");
    if (end.code == -signal && !fs::exists(w / "r/manifest.json")) continue;
    if (end.code != 0 && end.code != kExitStopped) return wrong_code(end, "0 or 75");
    stopped += end.code == kExitStopped;
    if (const std::string wrong = finish(w, "r"); !wrong.empty()) return wrong;
  }
  figures = fmt::format("{} of {} stopped", stopped, count);
  return stopped == 0 && count == 20 ? "none was stopped" : "";
}

std::string hang_up(Workshop& w, double share, std::string& figures) {
  return stop_by(SIGHUP, w, share, figures);
}
std::string terminate(Workshop& w, double share, std::string& figures) {
  return stop_by(SIGTERM, w, share, figures);
}

// Both streams go into a pipe that nobody reads any more.
std::string broken_pipe(Workshop& w, double, std::string& figures) {
  fs::remove_all(w / "r");
  Command c = w.run_into("r");
  std::erase(c.words, "-q");
  c.before = [] {
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(126);
    ::close(ends[0]);
    ::dup2(ends[1], 1), ::dup2(ends[1], 2);
  };
  const Ending end = run(c);
  if (end.code != 0 && end.code != kExitMachine && end.code != kExitStopped)
    return wrong_code(end, "0, 5 or 75");
  figures = fmt::format("exit {}", end.code);
  return finish(w, "r");
}

// No file may grow beyond this; then it may.
std::string file_size_limit(Workshop& w, double share, std::string& figures) {
  const int count = std::max(3, static_cast<int>(20 * share));
  int failed = 0;
  for (int n = 0; n < count; ++n) {
    fs::remove_all(w / "r");
    const rlim_t limit = 1u << (6 + n * 14 / count);
    Command c = w.run_into("r");
    c.before = [limit] {
      const rlimit bytes{limit, limit};
      ::setrlimit(RLIMIT_FSIZE, &bytes);
    };
    const Ending end = run(c);
    if (end.code != 0 && end.code != kExitMachine) return wrong_code(end, "0 or 5");
    failed += end.code == kExitMachine;
    if (const std::string wrong = finish(w, "r"); !wrong.empty())
      return fmt::format("{} bytes: {}", limit, wrong);
  }
  figures = fmt::format("{} of {} limits reached", failed, count);
  return "";
}

// The first has the folder; the second is refused, whenever it comes.
std::string two_runs(Workshop& w, double share, std::string& figures) {
  const int count = std::max(2, static_cast<int>(10 * share));
  for (int n = 0; n < count; ++n) {
    fs::remove_all(w / "r");
    const pid_t first = start(w.run_into("r"), w / "log"),
                second = start(w.run_into("r"), w / "log2");
    const Ending a = wait_for(first, 60.0, w / "log"), b = wait_for(second, 60.0, w / "log2");
    const bool one = (a.code == 0 && b.code == kExitInput) || (a.code == kExitInput && b.code == 0);
    if (!one) return wrong_code(a, "0 and 2") + wrong_code(b, "2 and 0");
    if (const std::string wrong = w.difference("r"); !wrong.empty()) return wrong;
  }
  figures = fmt::format("{} pairs", count);
  return "";
}

}  // namespace

const std::vector<Row>& signal_rows() {
  static const std::vector<Row> rows = {
      {"sighup", "hang-up at any moment: 75 or done, goes on bit-equal", hang_up},
      {"sigterm", "SIGTERM at any moment", terminate},
      {"sigpipe", "nobody reads the output", broken_pipe},
      {"sigxfsz", "limits of the file size from 64 bytes to 1 MB: 5, then bit-equal",
       file_size_limit},
      {"two-runs", "two runs into one folder at once: one is refused", two_runs}};
  return rows;
}

}  // namespace archetide
