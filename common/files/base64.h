#pragma once

#include <string>
#include <string_view>

namespace archetide {

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// Back again, up to the first padding or the end; blanks are skipped. False when some other
/// character stands in it.
bool from_base64(std::string_view text, std::string& bytes);

}  // namespace archetide
