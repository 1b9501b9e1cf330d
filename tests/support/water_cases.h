#pragma once

#include <vector>

#include "runtime/simulation.h"

namespace archetide {

/// Flows of water alone with a known answer. Each runs the whole simulation.

struct VortexResult {
  double energy_change = 0.0;   // of the kinetic energy, relative
  double velocity_error = 0.0;  // L2, relative to the largest speed
  int steps = 0;
  int iterations = 0;  // of the worst solve
};
/// Taylor-Green cells u = sin x cos y, v = -cos x sin y in a closed box of 2 pi with n^2 cells: a
/// steady flow of largest speed 1, followed for one turnover (2 pi) at this CFL number.
VortexResult taylor_green(int n, double cfl, Scheme scheme);

/// Unsteady vortices of stream function sin x sin y + sin 2x sin y in a closed box of pi, n^2
/// cells, until time 1: vertical velocity at (pi/4, pi/2)-like probes, 9 values, for
/// self-convergence.
VecX unsteady_vortices(int n, double cfl);

struct CarriedVortexResult {
  double velocity_error = 0.0;  // L2, relative to that of the vortex
  double energy_change = 0.0;   // of the vortex, relative
  int steps = 0;
  int iterations = 0;  // of the worst solve
};
/// Vortex u_theta = sqrt(e) r/s exp(-r^2 / 2 s^2) of core radius s = 0.06 and largest speed 1,
/// steady and without circulation, carried by the stream (1, 1/2) through a box of 1.2 x 0.9 with
/// open sides and n cells to a length of 1, until time 1/2: a third of the box, 2.2 turns of its
/// core. u = stream + vortex(x - stream t) is a solution of Euler's equations; at the sides the
/// vortex is below 1e-5.
CarriedVortexResult carried_vortex(int n, double cfl, Scheme scheme);

struct SloshResult {
  double period = 0.0;  // s
  double decay = 0.0;   // of the amplitude in a period, relative
  int steps = 0;
  int iterations = 0;  // of the worst solve
};
/// First mode of a tank of length L = 1 m, depth 0.5 m, n cells long, amplitude 0.01 m, over
/// three periods.
SloshResult sloshing(int n, double max_dt, int particles, const Damping& damping = {});

/// Largest speed in 1000 steps of a still tank of 16^3 cells, over sqrt(g h).
double still_tank_speed(int particles);

struct FrontResult {
  std::vector<double> time, front, height;  // s, m: foot of the water on the floor; at the wall
  int steps = 0;
  int iterations = 0;  // of the worst solve
};
/// Collapse of a water column a wide and 2 a high, a = 0.05715 m, n cells across, until t = end.
FrontResult column_collapse(int n, double end);

struct SteepWavesResult {
  double volume_change = 0.0;  // relative, without volume control
  int steps = 0;
};
/// Waves of both kinds across a tank of 1 m x 1 m x 1.5 m with n cells a metre and 0.5 m of water
/// at rest at first, surface 0.5 + a cos(pi x) + 0.6 a cos(2 pi y), for 2 s, with a ball of 0.2 m
/// radius and half the water's density in it if asked for. At a = 0.1 m they break.
SteepWavesResult steep_waves(int n, double amplitude, bool ball);

struct DropResult {
  double long_axis[2], short_axis[2];  // m, at A0 t = 1 and 2 (spheroid: 0.5 and 1)
  double volume_change = 0.0;          // relative
  int steps = 0;
  int iterations = 0;  // of the worst solve
};
/// Circular drop of radius 1 with n cells per radius, u = (x, -y), no gravity.
DropResult elliptic_drop(int n, double cfl, int particles);
/// Sphere of radius 1 with n cells per radius, u = sign (-x/2, -y/2, z), no gravity; the axes are
/// those along z and across.
DropResult spheroid_drop(int n, double cfl, int particles, double sign);

}  // namespace archetide
