#include "precompute/log.h"

#include <iostream>

#include "common/base/input_error.h"

namespace archetide {

void Log::also_to(const std::string& path) {
  file_.open(path);
  if (!file_) throw MachineError(path + ": the log file cannot be opened");
}

void Log::print(const std::string& text) {
  std::cerr << text << std::endl;
  if (file_.is_open()) file_ << text << std::endl;
}

void Log::warn(const std::string& text) {
  if (level_ != Level::kSilent) print("warning: " + text);
}

void Log::say(const std::string& text) {
  if (level_ >= Level::kNormal) print(text);
}

void Log::detail(const std::string& text) {
  if (level_ == Level::kVerbose) print(text);
}

}  // namespace archetide
