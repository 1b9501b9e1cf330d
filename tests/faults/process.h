#pragma once

#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

namespace archetide {

/// A program to run, and how.
struct Command {
  std::vector<std::string> words;          // the program's path first
  std::string folder = ".";                // where it runs
  std::vector<std::string> environment{};  // NAME=value, besides ours
  std::function<void()> before = [] {};    // in the new process, behind the redirections
  double seconds = 60.0;                   // longer: SIGTERM, then SIGKILL
};

/// How it ended.
struct Ending {
  int code = -1;           // exit code, or minus the signal
  bool timed_out = false;  // it did not end by itself
  bool deaf = false;       // nor on SIGTERM
  std::string text;        // stdout and stderr, at most 64 kB
  double seconds = 0.0;
  double peak_megabytes = 0.0;
};

/// "exit 3 instead of 0: what it said"
std::string wrong_code(const Ending& end, const std::string& wanted);

/// Starts it with stdout and stderr into the file `log`. Throws std::runtime_error when it cannot.
pid_t start(const Command& command, const std::string& log);
/// Waits for it, as long as it may take.
Ending wait_for(pid_t child, double seconds, const std::string& log);
/// Both.
Ending run(const Command& command);

/// Kills it (SIGKILL) after `delay` seconds, or when `now` says so; true when it had not ended.
bool kill_when(pid_t child, double delay, const std::function<bool()>& now);

std::string bytes_of(const std::string& path);
void write_bytes(const std::string& path, const std::string& bytes);

}  // namespace archetide
