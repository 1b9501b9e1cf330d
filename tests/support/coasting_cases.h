#pragma once

#include "runtime/simulation.h"

namespace archetide {

/// A rigid ellipsoid of half the water's density coasts through still water in a closed, full,
/// weightless tank. The flow is irrotational and nothing acts on it: its energy is constant.
struct CoastOptions {
  int cells_per_radius = 4;
  Vec3 axes = Vec3::Ones();        // semi-axes, in radii
  Vec3 offset = Vec3::Zero();      // of its centre from the tank's, cells
  double dt = 1e-2, speed = 1e-3;  // s; radii / s
  int steps = 50;
  Scheme scheme = Scheme::kNewmark;
  bool contact = false;  // between bodies, switched on with a second body that is never met
};
struct CoastResult {
  double worst_step = 0.0;  // largest |change| of the energy in a step, of the energy
  double change = 0.0;      // of the energy over the run, of the energy
  double slowed = 0.0;      // of the speed over the run, of the speed
};
CoastResult coast(const CoastOptions& options);

}  // namespace archetide
