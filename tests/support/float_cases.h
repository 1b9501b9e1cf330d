#pragma once

#include "runtime/simulation.h"

namespace archetide {

/// Bodies in water whose end state or invariant is known.

struct FloatResult {
  double draft = 0.0;  // mean over the last third, in radii
  int steps = 0, iterations = 0;
};
/// Sphere of radius 0.2 m, so many cells, in a tank of 1 m x 1 m with 0.6 m of water, let go a
/// tenth of its radius above its floating height; followed for `end` s.
FloatResult floating_sphere(int cells_per_radius, double density_ratio, double end);

struct Heave {
  double time[2] = {0.0, 0.0};    // of the first two extrema, sqrt(radius / g)
  double height[2] = {0.0, 0.0};  // over the floating height, in the height it was let go from
  int steps = 0, iterations = 0;
};
/// A half-immersed sphere let go a twentieth of its radius above its floating height in still
/// water, 24 radii wide and 12 deep (half of that: the second extremum 4 % higher), until its
/// second extremum (before its waves come back). Steps of `share` of the step that the simulation
/// chooses.
Heave heaving_sphere(int cells_per_radius, double share);

struct TankMomentum {
  double worst = 0.0;  // |P_water + rho V v| / (rho V |v|) over the run
  int iterations = 0;
};
/// A sphere of half the water's density thrown through a full, closed, weightless tank: the centre
/// of the tank's volume stays, so the water carries -rho V v at every instant.
TankMomentum closed_tank_momentum(int cells_per_radius);

/// A blob of four modes from `first_omega` rad/s up let go under an open top, velocity after one
/// solve of 0.01 s: its distance from that of the rigid blob, relative.
double velocity_off_rigid(double first_omega);

struct BoxImpact {
  double passes = 0.0;                           // H2 reaches 0.05 m, s
  double h2_05 = 0.0, h4_04 = 0.0, h4_05 = 0.0;  // m
  double struck = 0.0;                           // P1 bears a quarter of its peak, s
  double p1_peak = 0.0, p1_05 = 0.0;             // Pa, the mean of the 10 ms before 0.5 s
  double kept = 0.0, shown = 0.0;  // largest change of all water, and of what is in sight
  double energy_rise = 0.0;        // above what it was before, of the fall's energy
  int steps = 0, iterations = 0;
};
/// Dam break against a box [KFVVB05] with cells of 3.22 m / n, until 2 s; what it bears until 0.5 s.
BoxImpact dam_break_on_box(int n);

}  // namespace archetide
