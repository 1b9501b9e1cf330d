#include "tests/scorecard/score.h"

#include <cstdio>
#include <map>

namespace archetide {

bool ScoreRow::as_known() const {
  if (known_reason.empty()) return meets_target();
  const double ratio = error / known_error;
  return !meets_target() && ratio > 0.85 && ratio < 1.15;
}

ScoreRow score(std::string quantity, std::string resolution, double value, double reference,
               double target, int iterations) {
  ScoreRow row;
  row.quantity = std::move(quantity), row.resolution = std::move(resolution);
  row.value = value, row.reference = reference, row.target = target, row.iterations = iterations;
  row.error = reference != 0.0 ? value / reference - 1.0 : value;
  return row;
}

ScoreRow known_miss(ScoreRow row, double measured_error, std::string reason) {
  row.known_error = measured_error, row.known_reason = std::move(reason);
  return row;
}

std::string at_first_frequency(double omega) {
  char text[48];
  std::snprintf(text, sizeof text, "first frequency %g rad/s", omega);
  return text;
}

void fill_orders(std::vector<ScoreRow>& rows, double ratio) {
  std::map<std::string, double> last;
  for (ScoreRow& row : rows) {
    const auto before = last.find(row.quantity);
    if (before != last.end())
      row.order = std::log(std::abs(before->second / row.error)) / std::log(ratio);
    last[row.quantity] = row.error;
  }
}

}  // namespace archetide
