#pragma once

#include "runtime/simulation.h"

namespace archetide {

/// Soft bodies in water from which nothing takes anything: what is left of momentum and energy.
struct ConservationResult {
  double momentum = 0.0;          // largest |P - P(0)|, of |P(0)|
  double angular_momentum = 0.0;  // largest |L - L(0)| about the tank's corner, of |L(0)|
  double energy = 0.0;            // energy at the end, of that at the start
  double transport = 0.0;         // share of the first energy that moving the water has changed
  int steps = 0, iterations = 0;
};

/// A ball of water, radius 0.35 m, with a soft one of 0.14 m and 0.7 of its density beside its
/// middle, drifts through a weightless, open tank of 1 m at 0.13 m/s and turns; the soft one is let
/// go squeezed. n^3 cells, 1 s.
ConservationResult drifting_blob(int n);

/// A soft ring (0.25 and 0.08 m, half the water's density) let go bent by so much, m, in a closed,
/// full, weightless tank of 1 m. n^3 cells, 1 s.
ConservationResult ringing_ring(int n, double bent);

}  // namespace archetide
