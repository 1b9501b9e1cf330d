#pragma once

#include <csignal>

namespace archetide {

/// Set when a signal has asked for an end.
extern volatile std::sig_atomic_t interrupted;

/// From here on signals that ask for an end let the step be finished. A terminal or a pipe that is
/// gone takes only what is shown there.
void stop_on_signals();

}  // namespace archetide
