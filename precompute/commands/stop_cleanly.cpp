#include "precompute/commands/stop_cleanly.h"

#include <unistd.h>

#include <csignal>

#include "common/base/input_error.h"

namespace archetide {
namespace {

/// X.part of the output in the making, for the handler below.
std::string unfinished;

extern "C" void stop(int) {
  ::unlink(unfinished.c_str());
  constexpr char kText[] = "stopped; nothing was written\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText, sizeof kText - 1);
  ::_exit(kExitStopped);
}

}  // namespace

void stop_cleanly(const std::string& output) {
  if (!output.empty()) unfinished = output + ".part";
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  if (std::signal(SIGHUP, stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // as nohup wants
}

}  // namespace archetide
