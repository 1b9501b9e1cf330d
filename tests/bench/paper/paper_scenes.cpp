#include "tests/bench/paper/paper_scenes.h"

#include <fmt/core.h>

#include <cstdlib>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

constexpr const char* kBlanks = " \t";
constexpr std::size_t kFields = 7;

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream parts(line);
  for (std::string part; std::getline(parts, part, '|');) fields.push_back(trimmed(part));
  return fields;
}

InputError refused(const std::string& path, int line, const std::string& what,
                   const std::string& hint) {
  return InputError({Diagnostic{{path, line, 0}, what, hint}});
}

double goal_of(const std::string& text, const std::string& path, int line) {
  if (text == "-") return std::numeric_limits<double>::quiet_NaN();
  char* end = nullptr;
  const double goal = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(goal > 0.0))
    throw refused(path, line, "the goal \"" + text + "\" is no number of seconds",
                  "write a number above 0, or - for none");
  return goal;
}

}  // namespace

std::vector<PaperScene> read_paper_scenes(const std::string& path) {
  std::istringstream lines(read_whole_file(path));
  std::vector<PaperScene> scenes;
  std::string text;
  for (int line = 1; std::getline(lines, text); ++line) {
    if (trimmed(text).empty() || text[0] == '#') continue;
    const std::vector<std::string> f = fields_of(text);
    if (f.size() != kFields)
      throw refused(path, line, fmt::format("{} fields, not 7", f.size()),
                    "name | figure | scene | goal | settings | quick settings | what it shows");
    scenes.push_back({f[0], f[1], f[2], goal_of(f[3], path, line), f[4], f[6]});
  }
  return scenes;
}

}  // namespace archetide
