#pragma once

#include <stdexcept>
#include <string>

#include "common/base/input_error.h"

namespace archetide {

/// What a fuzz target finds wrong with a reader.
struct Finding : std::logic_error {
  using std::logic_error::logic_error;
};

/// Whether `read` accepts its input. It may refuse it with an exit code other than 1 and a message.
template <class Read>
bool accepts(const Read& read) {
  try {
    read();
    return true;
  } catch (const Error& refusal) {
    if (refusal.exit_code == kExitBug || std::string(refusal.what()).empty())
      throw Finding("a refusal without a reason");
    return false;
  }
}

}  // namespace archetide
