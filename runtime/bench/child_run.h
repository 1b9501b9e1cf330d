#pragma once

#include <csignal>
#include <string>
#include <vector>

namespace archetide {

/// How a child process ended and what it used, as the system accounts for it.
struct ChildEnd {
  int exit = -1;   // -1: killed by `signal`
  int signal = 0;  // 0: it exited
  double cpu_seconds = 0.0, wall_seconds = 0.0, peak_bytes = 0.0;
};

/// Runs `arguments` (the program first), both outputs going to the file `log`, and waits. When
/// `stop` becomes set the child is told to stop (SIGTERM), and waited for. It does not outlive us.
/// Throws MachineError when there is no process to be had.
ChildEnd run_child(const std::vector<std::string>& arguments, const std::string& log,
                   const volatile std::sig_atomic_t& stop);

}  // namespace archetide
