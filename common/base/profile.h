#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace archetide {

/// Accumulated wall seconds per named phase, in order of first use. Nested names by '/'.
class Profile {
 public:
  void add(const std::string& phase, double seconds);
  double seconds(const std::string& phase) const;
  const std::vector<std::string>& phases() const { return order_; }
  void clear();

 private:
  std::vector<std::string> order_;
  std::map<std::string, double> seconds_;
};

/// Adds the life time of the scope to a phase, less what is handed over to others.
class ScopedTimer {
 public:
  ScopedTimer(Profile& profile, std::string phase)
      : profile_(profile), phase_(std::move(phase)), start_(std::chrono::steady_clock::now()) {}
  ~ScopedTimer() {
    const std::chrono::duration<double> life = std::chrono::steady_clock::now() - start_;
    profile_.add(phase_, life.count() - handed_over_);
  }
  /// Seconds of this scope that belong to another phase.
  void hand_over(const std::string& phase, double seconds) {
    profile_.add(phase, seconds);
    handed_over_ += seconds;
  }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  Profile& profile_;
  std::string phase_;
  double handed_over_ = 0.0;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace archetide
