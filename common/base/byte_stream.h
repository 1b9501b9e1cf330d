#pragma once

#include <bit>
#include <cstring>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>

namespace archetide {

static_assert(std::endian::native == std::endian::little,
              "PLY and VTP frames are written as the bytes of this machine, little endian");

/// Appends the bytes of one number.
template <class T>
void append_number(std::string& bytes, T value) {
  static_assert(std::is_arithmetic_v<T>);
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  bytes.append(raw, sizeof(T));
}

/// Reads one number at `offset` and moves past it; the caller has checked the length.
template <class T>
T take_number(std::string_view bytes, std::size_t& offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  offset += sizeof(T);
  return value;
}

/// Hands the file over piece by piece. Throws FileError when it cannot be read, or is no file but a
/// folder, a pipe or a device.
void read_file_in_blocks(const std::string& path,
                         const std::function<void(std::string_view)>& take);

/// The whole file at once. Throws FileError as above.
std::string read_whole_file(const std::string& path);

}  // namespace archetide
