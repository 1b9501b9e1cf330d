#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace archetide {

/// SHA-256 (FIPS 180-4) of a stream of bytes.
class Sha256 {
 public:
  void update(const void* data, std::size_t bytes);
  void update(std::string_view text) { update(text.data(), text.size()); }
  /// The digest in hexadecimal; ends the stream.
  std::string hex();

 private:
  void compress(const std::uint8_t* block);

  std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};
  std::size_t in_block_ = 0;  // bytes waiting in block_
  std::uint64_t total_bytes_ = 0;
};

std::string sha256_hex(std::string_view text);

/// SHA-256 of a file's bytes, hex. Throws FileError when it cannot be read.
std::string sha256_of_file(const std::string& path);

}  // namespace archetide
