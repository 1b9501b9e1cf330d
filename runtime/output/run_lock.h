#pragma once

#include <string>

namespace archetide {

/// A run folder in the hands of this process: made where it is missing, and no other run's until
/// this object goes (or the process, however it ends). The lock is on the folder itself; nothing is
/// written.
class RunLock {
 public:
  /// Throws InputError when another run has the folder, MachineError when it cannot be made.
  explicit RunLock(const std::string& folder);
  ~RunLock();
  RunLock(const RunLock&) = delete;
  RunLock& operator=(const RunLock&) = delete;

 private:
  int descriptor_ = -1;
};

}  // namespace archetide
