#pragma once

#include <vector>

namespace archetide {

/// Of an oscillation sampled once a step: omega dt, and the relative change of its amplitude in a
/// period.
struct RingingRate {
  double omega_dt = 0.0, amplitude = 0.0;
};
RingingRate ringing_rate(const std::vector<double>& samples);

/// A soft cylinder (radius 0.2 m, half the water's density) across a closed, full slab of 8 radii
/// rings in its mode cos(degree angle); unbounded water of the plane weighs rho a / degree on each
/// normal velocity. Frequency and amplitude over two periods against that, relative.
struct CylinderRinging {
  double frequency = 0.0, amplitude = 0.0;
  int iterations = 0;
};
CylinderRinging ringing_cylinder(int degree, int cells_per_radius);

}  // namespace archetide
