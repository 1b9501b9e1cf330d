#include "tests/bench/frame_costs.h"

#include <algorithm>

#include "common/base/input_error.h"

namespace archetide {

const std::vector<double>& column_of(const CsvTable& table, const std::string& name) {
  if (!table.has(name)) throw FileError("a table of the run has no column " + name);
  return table.column(name);
}

FrameCosts frame_costs(const CsvTable& stats, const std::vector<double>& times) {
  const std::vector<double>&t = column_of(stats, "t"), &seconds = column_of(stats, "seconds"),
        &velocity = column_of(stats, "iterations"),
        &position = column_of(stats, "iterations_position");
  FrameCosts costs;
  costs.seconds.assign(times.size(), 0.0);
  costs.iterations.assign(times.size(), 0.0);
  std::vector<int> steps(times.size(), 0);
  constexpr double kSameTime = 1e-9;  // s
  for (std::size_t n = 0; n < t.size(); ++n) {
    const auto at = std::lower_bound(times.begin(), times.end(), t[n] - kSameTime);
    const auto frame = static_cast<std::size_t>(at - times.begin());
    if (frame >= times.size()) continue;
    costs.seconds[frame] += seconds[n];
    costs.iterations[frame] += 0.5 * (velocity[n] + position[n]);
    ++steps[frame];
  }
  for (std::size_t f = 0; f < times.size(); ++f)
    if (steps[f] > 0) costs.iterations[f] /= steps[f];
  return costs;
}

}  // namespace archetide
