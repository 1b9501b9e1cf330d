#include "common/files/make_word.h"

#include <string_view>

#include "common/base/input_error.h"

namespace archetide {
namespace {

/// What a makefile would take for a separator, a pattern, an assignment, a recipe or a wildcard.
constexpr std::string_view kForbidden = "%=;|&*?[]\\'\"`<>(){}";

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

/// The name with control characters as \xHH, so that the message is one line.
std::string printable(const std::string& name) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (const char c : name) {
    if (is_control(c))
      out += {'\\', 'x', kDigits[c >> 4], kDigits[c & 15]};
    else
      out += c;
  }
  return out;
}

[[noreturn]] void refuse_word(const std::string& path, const std::string& what) {
  throw InputError({{{printable(path), 0, 0},
                     "make cannot handle this file name: it " + what,
                     "rename it to letters, digits, '.', '_' and '-'"}});
}

}  // namespace

std::string make_word(const std::string& path) {
  if (path.empty()) throw InputError("an empty file name", "name a file");
  if (path[0] == '~') refuse_word(path, "begins with ~");
  if (path.size() > 1 && path[0] == '.' && path[1] >= 'A' && path[1] <= 'Z')
    refuse_word(path, "begins like make's own words");
  std::string word;
  for (const char c : path) {
    if (is_control(c)) refuse_word(path, "holds a tab, a line break or another control character");
    if (kForbidden.find(c) != std::string_view::npos)
      refuse_word(path, std::string("holds the character ") + c);
    if (c == ' ' || c == '#' || c == ':') word += '\\';
    if (c == '$') word += '$';
    word += c;
  }
  return word;
}

std::string make_fragment(const std::string& target, const std::vector<std::string>& files) {
  std::string text = make_word(target) + ":", rules;
  for (const std::string& file : files) {
    text += " \\\n  " + make_word(file);
    rules += "\n" + make_word(file) + ":\n";
  }
  return text + "\n" + rules;
}

}  // namespace archetide
