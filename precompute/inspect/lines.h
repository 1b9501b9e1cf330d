#pragma once

// Lines of what `info` and `check` print for people.

#include <iomanip>
#include <sstream>
#include <string>

#include "common/base/types.h"

namespace archetide::lines {

/// A name, and behind it what is said about it.
inline void line(std::ostringstream& text, const std::string& name, const std::string& value) {
  text << std::left << std::setw(14) << name << ' ' << value << '\n';
}

/// The parts one after the other, numbers with six digits.
template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream text;
  text << std::setprecision(6);
  (text << ... << parts);
  return text.str();
}

inline std::string row(const Vec3& x) { return join(x[0], "  ", x[1], "  ", x[2]); }

}  // namespace archetide::lines
