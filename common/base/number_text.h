#pragma once

#include <string>

namespace archetide {

/// The shortest decimal text that reads back as exactly `value`.
std::string number_text(double value);

/// With `decimals` digits after the point.
std::string fixed_text(double value, int decimals);

/// With two significant digits and a power of ten: "1.2e-03".
std::string scientific_text(double value);

/// With three significant digits and a binary prefix: "1.25 GiB".
std::string bytes_text(double bytes);

/// "0:42", "12:05" or "3:02:10".
std::string duration_text(double seconds);

}  // namespace archetide
