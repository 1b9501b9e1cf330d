#pragma once

namespace archetide {

/// Depth of the lowest point of a floating sphere of density ratio s under the surface, in radii:
/// the root of h^2 (3 - h) = 4 s.
inline double exact_draft(double s) {
  double low = 0.0, high = 2.0;
  for (int n = 0; n < 60; ++n) {
    const double h = 0.5 * (low + high);
    (h * h * (3.0 - h) < 4.0 * s ? low : high) = h;
  }
  return 0.5 * (low + high);
}

}  // namespace archetide
