#pragma once

// Lines of what `info` and `check` print for people.

#include <iomanip>
#include <sstream>
#include <string>

#include "common/base/types.h"
#include "precompute/base/joined.h"

namespace archetide::lines {

/// A name, and behind it what is said about it.
inline void line(std::ostringstream& text, const std::string& name, const std::string& value) {
  text << std::left << std::setw(14) << name << ' ' << value << '\n';
}

inline std::string row(const Vec3& x) { return joined(x[0], "  ", x[1], "  ", x[2]); }

}  // namespace archetide::lines
