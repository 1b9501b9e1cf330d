#include "runtime/articulation/external_load.h"

#include <algorithm>

namespace archetide {

ExternalLoad::Sample ExternalLoad::at(double t) const {
  if (t < start || t > end) return {t};
  const auto after = std::upper_bound(samples.begin(), samples.end(), t,
                                      [](double x, const Sample& s) { return x < s.t; });
  if (after == samples.begin()) return {t, samples.front().force, samples.front().torque};
  if (after == samples.end()) return {t, samples.back().force, samples.back().torque};
  const Sample &a = *(after - 1), &b = *after;
  const double share = (t - a.t) / (b.t - a.t);
  return {t, a.force + share * (b.force - a.force), a.torque + share * (b.torque - a.torque)};
}

}  // namespace archetide
