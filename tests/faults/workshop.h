#pragma once

#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/faults/process.h"

namespace archetide {

/// A folder with a scene, a body file and what an undisturbed run and build make of them.
class Workshop {
 public:
  /// `bin`: folder of the programs; `folder`: emptied first.
  Workshop(std::string bin, std::string folder, unsigned seed);

  /// The verb run on the small scene into folder/`out`, one thread.
  Command run_into(const std::string& out, const std::vector<std::string>& more = {}) const;
  /// The verb build of the small body into folder/`out`.
  Command build_into(const std::string& out) const;

  /// "" when the run in folder/`out` is complete and, but for seconds and times, is bit for bit
  /// what the undisturbed run made; else what differs.
  std::string difference(const std::string& out) const;
  /// The same of an archetype.
  std::string build_difference(const std::string& out) const;

  std::string operator/(const std::string& name) const { return folder_ + "/" + name; }
  const std::string& sim() const { return sim_; }
  double run_seconds() const { return run_seconds_; }
  double build_seconds() const { return build_seconds_; }
  std::mt19937& random() { return random_; }
  double uniform(double low, double high);

 private:
  std::string sim_, precompute_, folder_;
  std::mt19937 random_;
  std::map<std::string, std::string> run_files_;  // contents by name, as compared
  std::string archetype_;
  double run_seconds_ = 0.0, build_seconds_ = 0.0;
};

/// A row of the table.
struct Row {
  const char* name;
  const char* what;
  /// What went wrong, "" when nothing did; `figures`: what was tried. `share` in (0, 1] of the whole
  /// number of trials.
  std::string (*test)(Workshop& w, double share, std::string& figures);
};

const std::vector<Row>& kill_rows();
const std::vector<Row>& signal_rows();
const std::vector<Row>& machine_rows();
const std::vector<Row>& environment_rows();

}  // namespace archetide
