#pragma once

#include <iomanip>
#include <sstream>
#include <string>

namespace archetide {

/// The parts one after the other, numbers with `digits` digits.
template <int digits = 6, class... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream text;
  text << std::setprecision(digits);
  (text << ... << parts);
  return text.str();
}

}  // namespace archetide
