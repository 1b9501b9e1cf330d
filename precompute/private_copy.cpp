#include "precompute/private_copy.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/byte_stream.h"
#include "common/input_error.h"

namespace archetide {
namespace {

std::string new_folder() {
  std::error_code problem;
  const std::filesystem::path top = std::filesystem::temp_directory_path(problem);
  std::string name = (top / "archetide-XXXXXX").string();
  if (problem || !::mkdtemp(name.data()))
    throw MachineError(name + ": no folder for temporary files: " + std::strerror(errno) +
                       "; set TMPDIR to one that can be written");
  return name;
}

}  // namespace

PrivateCopy::PrivateCopy(const std::string& path, const std::string& name)
    : folder_(new_folder()), path_(folder_ + "/" + name) {
  try {
    std::ofstream out(path_, std::ios::binary);
    read_file_in_blocks(path, [&](std::string_view block) {
      out.write(block.data(), static_cast<std::streamsize>(block.size()));
    });
    out.close();
    if (!out) throw MachineError(path_ + ": no room for a copy of " + path);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
    throw;
  }
}

PrivateCopy::~PrivateCopy() {
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

}  // namespace archetide
