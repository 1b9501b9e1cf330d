#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "tests/support/cpu_seconds.h"

namespace archetide {

/// One measured figure next to its reference.
struct ScoreRow {
  std::string quantity, resolution;
  double value = 0.0, reference = 0.0;
  double error = 0.0;   // value / reference - 1, or the value itself where the reference is 0
  double target = 0.0;  // largest |error| that passes
  double order = std::numeric_limits<double>::quiet_NaN();  // against the row before
  double cpu_seconds = 0.0;
  int iterations = 0;  // of the worst solve; 0: nothing was solved
  // A miss that is known: the error that was measured, and why.
  double known_error = 0.0;
  std::string known_reason = {};

  bool meets_target() const { return std::abs(error) <= target; }
  /// It meets its target, or misses it as it is known to (within 15 %, both ways).
  bool as_known() const;
};

/// A case: one function that returns its rows. `quick` cases run with every fast test.
struct ScoreCase {
  std::string name;
  bool quick = false;
  std::string about;  // what is measured, where the reference and the target come from
  std::function<std::vector<ScoreRow>()> run;
};

/// Relative error of `value` (reference not 0), or the value itself.
ScoreRow score(std::string quantity, std::string resolution, double value, double reference,
               double target, int iterations = 0);
/// The same of a row that is known to miss.
ScoreRow known_miss(ScoreRow row, double measured_error, std::string reason);

/// CPU seconds of this process and its children since `start` was taken.
class CpuClock {
 public:
  double seconds() const { return cpu_seconds() - start_; }

 private:
  double start_ = cpu_seconds();
};

/// Runs `work`, a function that returns a row, and notes its CPU seconds.
template <class Work>
ScoreRow timed(const Work& work) {
  const CpuClock clock;
  ScoreRow row = work();
  row.cpu_seconds = clock.seconds();
  return row;
}

/// "first frequency OMEGA rad/s", the resolution of rows on stiffer and stiffer bodies.
std::string at_first_frequency(double omega);

/// Orders between rows of the same quantity that follow each other, each `ratio` times finer.
void fill_orders(std::vector<ScoreRow>& rows, double ratio = 2.0);

// The families, one file each.
std::vector<ScoreCase> single_solve_scores();
std::vector<ScoreCase> water_scores();
std::vector<ScoreCase> dry_body_scores();
std::vector<ScoreCase> coupled_scores();
std::vector<ScoreCase> elastic_scores();  // none without the precompute

}  // namespace archetide
