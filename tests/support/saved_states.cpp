#include "tests/support/saved_states.h"

#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>

#include "common/base/sha256.h"
#include "common/files/state_file.h"

namespace archetide {

SavedStates::SavedStates(const std::string& name)
    : folder_(fmt::format("{}/{}_{}/", std::filesystem::temp_directory_path().string(), name,
                          ::getpid())) {
  std::filesystem::create_directories(folder_);
}
SavedStates::~SavedStates() { std::filesystem::remove_all(folder_); }

std::string SavedStates::save(Simulation& simulation, const std::string& name) const {
  StateWriter file(folder_ + name, "test", 1);
  simulation.visit_state(file);
  file.commit();
  return folder_ + name;
}

void SavedStates::load(Simulation& simulation, const std::string& path) const {
  StateReader file(path, "test", 1, "");
  simulation.visit_state(file);
  file.demand_hash();
}

std::string SavedStates::hash(Simulation& simulation) const {
  return sha256_of_file(save(simulation, "hashed.h5"));
}

}  // namespace archetide
