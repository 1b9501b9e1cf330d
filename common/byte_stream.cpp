#include "common/byte_stream.h"

#include <fstream>
#include <sstream>

#include "common/input_error.h"

namespace archetide {

std::string read_whole_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path + ": cannot be opened");
  std::ostringstream content;
  content << in.rdbuf();
  if (in.bad()) throw FileError(path + ": cannot be read");
  return std::move(content).str();
}

}  // namespace archetide
