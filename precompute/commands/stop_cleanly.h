#pragma once

#include <string>

namespace archetide {

/// From here on SIGINT, SIGTERM and SIGHUP end the program with exit code 75 and leave nothing
/// half-written; `output` ("": none) is what is written when all is done.
void stop_cleanly(const std::string& output);

}  // namespace archetide
