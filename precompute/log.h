#pragma once

#include <fstream>
#include <string>

namespace archetide {

/// What the program says while it works: to stderr and, on request, to a file.
class Log {
 public:
  enum class Level { kSilent, kQuiet, kNormal, kVerbose };
  explicit Log(Level level = Level::kNormal) : level_(level) {}
  /// Throws MachineError when the file cannot be opened.
  void also_to(const std::string& path);

  void set_level(Level level) { level_ = level; }

  void error(const std::string& text) { print(text); }
  void warn(const std::string& text);    // unless silent
  void say(const std::string& text);     // not with -q
  void detail(const std::string& text);  // only with -v

 private:
  void print(const std::string& text);
  Level level_;
  std::ofstream file_;
};

}  // namespace archetide
