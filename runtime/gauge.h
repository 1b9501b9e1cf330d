#pragma once

#include <optional>
#include <string>

#include "runtime/simulation.h"

namespace archetide {

/// A place where the water is measured after every step.
struct Gauge {
  std::string name;
  Vec3 point = Vec3::Zero();  // m
};

/// What a gauge reads; nothing where there is nothing to read.
struct GaugeReading {
  /// Above the pressure of the air, Pa; 0 in air, none inside solids. The mean of the last step, in
  /// which the pressure makes the velocities of its end. In a tank without air its level is
  /// arbitrary.
  std::optional<double> pressure;
  std::optional<Vec3> velocity;  // of the water, m/s; none in air and solids
  std::optional<double> level;  // m, z of the highest surface above or below the point; none if dry
};

/// Of a simulation whose last step took dt, s: p = p' + rho g . (x - x_ref) with p' interpolated
/// between the cells that are water (docs/method.md, C1).
GaugeReading read_gauge(const Simulation& simulation, double dt, const Vec3& point);

}  // namespace archetide
