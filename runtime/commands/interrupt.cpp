#include "runtime/commands/interrupt.h"

namespace archetide {
namespace {

extern "C" void on_interrupt(int) { interrupted = 1; }

}  // namespace

volatile std::sig_atomic_t interrupted = 0;

void stop_on_signals() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // nohup
  std::signal(SIGPIPE, SIG_IGN);
}

}  // namespace archetide
