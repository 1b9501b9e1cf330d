#include "runtime/output/progress.h"

#include <unistd.h>

#include <cstdio>

#include "common/base/input_error.h"

namespace archetide {

Progress::Progress(const std::string& log_path, bool quiet, bool append)
    : log_(log_path, append ? std::ios::app : std::ios::trunc),
      quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) != 0) {
  if (!log_) throw MachineError(log_path + ": cannot be written");
}

Progress::~Progress() { end_frame_line(); }

void Progress::line(const std::string& text) {
  log_ << text << '\n' << std::flush;
  if (quiet_) return;
  end_frame_line();
  std::fprintf(stderr, "%s\n", text.c_str());
}

void Progress::frame_line(const std::string& text) {
  log_ << text << '\n' << std::flush;
  if (quiet_) return;
  // ESC[K clears what a longer line before has left.
  if (terminal_)
    std::fprintf(stderr, "\r%s\033[K", text.c_str()), std::fflush(stderr);
  else
    std::fprintf(stderr, "%s\n", text.c_str());
  open_ = terminal_;
}

void Progress::end_frame_line() {
  if (open_) std::fputc('\n', stderr);
  open_ = false;
}

}  // namespace archetide
