#pragma once

#include <string>

namespace archetide {

/// A JSON value as a file. Names of files may be any bytes: those that are no UTF-8 become U+FFFD.
template <class Json>
std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace archetide
