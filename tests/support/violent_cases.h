#pragma once

namespace archetide {

/// What violent water did, and what it should not.
struct ViolentResult {
  int steps = 0, iterations = 0;  // iterations: of the worst solve
  double kept = 0.0;   // largest |change| of all water (surface, drops, residual), of the volume
  double shown = 0.0;  // largest |change| of what surface and drops show at the end of a frame
  double energy_rise = 0.0;  // largest, of the energy at the start
  double speed = 0.0;        // largest, m/s
  double calm_level = 0.0;   // two pools: largest change of the volume of the still one, of it
};

/// A column of 0.6 x 1 x 1 m collapses in a closed tank of 2 x 1 x 1.5 m, 1.5 s, 24 frames a
/// second, n cells a metre; deep: m, of the tank along y.
ViolentResult collapse(int n, double cfl, double deep = 1.0);

/// Two pools of 0.4 m with a wall of 0.2 m between them (x = 0.9 to 1.1 m) in the same tank: into
/// one falls a block of 0.5 x 0.6 x 0.4 m of water.
ViolentResult two_pools(int n, double cfl, double end = 1.5);

}  // namespace archetide
