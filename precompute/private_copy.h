#pragma once

#include <string>

namespace archetide {

/// A copy of a file, alone in a folder that only this user may enter; both go with this object. For
/// libraries that also read what stands beside a file, or decide by its name what to do with it.
class PrivateCopy {
 public:
  /// `name`: what the copy is called. Throws FileError when `path` cannot be read, MachineError
  /// when the copy cannot be written.
  PrivateCopy(const std::string& path, const std::string& name);
  ~PrivateCopy();
  PrivateCopy(const PrivateCopy&) = delete;
  PrivateCopy& operator=(const PrivateCopy&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string folder_, path_;
};

}  // namespace archetide
