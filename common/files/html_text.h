#pragma once

#include <string>

namespace archetide {

/// &, <, > and quotes replaced by entities.
std::string html_text(const std::string& text);

}  // namespace archetide
