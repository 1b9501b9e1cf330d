#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace archetide {

/// Eight bits a channel, sRGB, rows from top to bottom.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // 3 width height

  Image() = default;
  Image(int w, int h) : width(w), height(h), rgb(3 * static_cast<std::size_t>(w) * h) {}
};

/// True when this build reads and writes PNG.
bool png_available();

/// Throw MachineError when this build has no PNG.
std::string png_bytes(const Image& image);
void write_png(const std::string& path, const Image& image);  // atomic
/// Throws FileError when it is no PNG.
Image read_png(const std::string& path);

/// The mean over boxes of factor x factor pixels.
Image shrunk(const Image& image, int factor);

}  // namespace archetide
