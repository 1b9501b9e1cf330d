#include "common/base/profile.h"

namespace archetide {

void Profile::add(const std::string& phase, double seconds) {
  auto [it, is_new] = seconds_.try_emplace(phase, 0.0);
  if (is_new) order_.push_back(phase);
  it->second += seconds;
}

double Profile::seconds(const std::string& phase) const {
  auto it = seconds_.find(phase);
  return it == seconds_.end() ? 0.0 : it->second;
}

void Profile::clear() {
  order_.clear();
  seconds_.clear();
}

}  // namespace archetide
