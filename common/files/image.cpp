#include "common/files/image.h"

#ifdef ARCHETIDE_WITH_PNG
#include <png.h>
#endif

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/atomic_file.h"

namespace archetide {

#ifdef ARCHETIDE_WITH_PNG

bool png_available() { return true; }

std::string png_bytes(const Image& image) {
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  head.width = image.width, head.height = image.height;
  head.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(head);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&head, bytes.data(), &size, 0, image.rgb.data(), 0, nullptr))
    throw MachineError(std::string("libpng: ") + head.message);
  bytes.resize(size);
  return bytes;
}

Image read_png(const std::string& path) {
  const std::string bytes = read_whole_file(path);
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&head, bytes.data(), bytes.size()))
    throw FileError(path + ": " + head.message);
  head.format = PNG_FORMAT_RGB;
  Image image(static_cast<int>(head.width), static_cast<int>(head.height));
  if (!png_image_finish_read(&head, nullptr, image.rgb.data(), 0, nullptr))
    throw FileError(path + ": " + head.message);
  return image;
}

#else

bool png_available() { return false; }

std::string png_bytes(const Image&) {
  throw MachineError("this build has no PNG: install libpng-dev and build again");
}

Image read_png(const std::string&) {
  throw MachineError("this build has no PNG: install libpng-dev and build again");
}

#endif

void write_png(const std::string& path, const Image& image) {
  write_file_atomically(path, png_bytes(image));
}

Image shrunk(const Image& image, int factor) {
  Image small(image.width / factor, image.height / factor);
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int dy = 0; dy < factor; ++dy)
          for (int dx = 0; dx < factor; ++dx)
            sum += image.rgb[3 * (static_cast<std::size_t>(y * factor + dy) * image.width +
                                  x * factor + dx) +
                             c];
        small.rgb[3 * (static_cast<std::size_t>(y) * small.width + x) + c] =
            static_cast<std::uint8_t>((sum + factor * factor / 2) / (factor * factor));
      }
  return small;
}

}  // namespace archetide
