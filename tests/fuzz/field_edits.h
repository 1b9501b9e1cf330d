#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/files/hdf5_file.h"

namespace archetide {

/// Fields of a file by name.
using FieldMap = std::map<std::string, DataArray>;

/// Takes numbers off the front of an input, zeros behind its end.
class InputBytes {
 public:
  explicit InputBytes(std::string_view bytes) : rest_(bytes) {}
  bool empty() const { return rest_.empty(); }
  template <class T>
  T take() {
    T value{};
    const std::size_t n = std::min(sizeof value, rest_.size());
    std::memcpy(&value, rest_.data(), n);
    rest_.remove_prefix(n);
    return value;
  }

 private:
  std::string_view rest_;
};

/// Reads an input as a list of changes to fields, and makes them: other bytes somewhere, another
/// length along an axis, another type, or the field is gone.
void edit_fields(std::string_view input, FieldMap& fields);

}  // namespace archetide
