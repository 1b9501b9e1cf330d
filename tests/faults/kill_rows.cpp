// Killed at any moment, the same command goes on to the same result.

#include <fmt/core.h>
#include <sys/wait.h>

#include <cmath>
#include <filesystem>

#include "tests/faults/workshop.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

int trials(int all, double share) {
  return std::max(1, static_cast<int>(std::lround(all * share)));
}

const auto kNever = [] { return false; };

// Kills runs of `command(out)` at moments up to `latest` s, lets the same command finish, and
// compares.
template <class Make, class Differ>
std::string kill_and_repeat(Workshop& w, int count, double latest, const Make& command,
                            const Differ& difference, std::string& figures) {
  int killed = 0;
  for (int n = 0; n < count; ++n) {
    const std::string out = "killed";
    fs::remove_all(w / out);
    const pid_t child = start(command(out), w / "log");
    killed += kill_when(child, w.uniform(0.0, latest), kNever);
    ::waitpid(child, nullptr, 0);
    const Ending again = run(command(out));
    if (again.code != 0) return fmt::format("trial {}: exit {} {}", n, again.code, again.text);
    if (const std::string wrong = difference(out); !wrong.empty())
      return fmt::format("trial {}: {}", n, wrong);
  }
  figures = fmt::format("{} of {} killed", killed, count);
  return "";
}

std::string kill_runs(Workshop& w, double share, std::string& figures) {
  return kill_and_repeat(
      w, trials(200, share), w.run_seconds(),
      [&](const std::string& out) { return w.run_into(out); },
      [&](const std::string& out) { return w.difference(out); }, figures);
}

std::string kill_runs_early(Workshop& w, double share, std::string& figures) {
  return kill_and_repeat(
      w, trials(100, share), 0.05, [&](const std::string& out) { return w.run_into(out); },
      [&](const std::string& out) { return w.difference(out); }, figures);
}

std::string kill_builds(Workshop& w, double share, std::string& figures) {
  return kill_and_repeat(
      w, trials(200, share), w.build_seconds(),
      [&](const std::string& out) { return w.build_into(out); },
      [&](const std::string& out) { return w.build_difference(out); }, figures);
}

// Killed while a checkpoint, or LATEST, is being written; several times over until it is done.
std::string kill_in_checkpoints(Workshop& w, double share, std::string& figures) {
  const std::string out = "killed", folder = w / out + "/checkpoint";
  const auto writing = [&] {
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(folder, none))
      if (entry.path().extension() == ".part") return true;
    return false;
  };
  int killed = 0;
  for (int n = 0; n < trials(50, share); ++n) {
    fs::remove_all(w / out);
    for (int again = 0; again < 3; ++again) {
      const pid_t child = start(w.run_into(out), w / "log");
      const double passed = w.uniform(0.0, w.run_seconds());  // any of the checkpoints
      kill_when(child, passed, kNever) ? void(++killed) : void();
      ::waitpid(child, nullptr, 0);
      const pid_t next = start(w.run_into(out), w / "log");
      killed += kill_when(next, 60.0, writing);
      ::waitpid(next, nullptr, 0);
    }
    const Ending end = run(w.run_into(out));
    if (end.code != 0) return fmt::format("exit {} {}", end.code, end.text);
    if (const std::string wrong = w.difference(out); !wrong.empty()) return wrong;
  }
  figures = fmt::format("{} killed", killed);
  return "";
}

}  // namespace

const std::vector<Row>& kill_rows() {
  static const std::vector<Row> rows = {
      {"kill-run", "run killed at any moment, then repeated: bit-equal", kill_runs},
      {"kill-early", "run killed in its first 50 ms, then repeated", kill_runs_early},
      {"kill-checkpoint", "run killed while it writes a checkpoint, three times over",
       kill_in_checkpoints},
      {"kill-build", "build killed at any moment, then repeated: bit-equal", kill_builds}};
  return rows;
}

}  // namespace archetide
