#pragma once

#include <string>

#include "runtime/simulation.h"

namespace archetide {

/// Checkpoints of a test, in a folder that goes when this does.
class SavedStates {
 public:
  explicit SavedStates(const std::string& name);
  ~SavedStates();
  SavedStates(const SavedStates&) = delete;
  SavedStates& operator=(const SavedStates&) = delete;

  /// Returns the file.
  std::string save(Simulation& simulation, const std::string& name) const;
  void load(Simulation& simulation, const std::string& file) const;
  /// Of the bytes that the state would be saved as.
  std::string hash(Simulation& simulation) const;

 private:
  std::string folder_;
};

}  // namespace archetide
