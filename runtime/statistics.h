#pragma once

#include <vector>

#include "runtime/options.h"
#include "runtime/step_report.h"
#include "runtime/water_step.h"

namespace archetide {

/// Momenta and energies of one body, added to the report; one that goes as it is told has none.
void add_body_statistics(const ReducedBody& body, const Vec3& gravity, StepReport& report);

/// Volume of the water that cells hold (dx^3), m^3, and its first moment about the origin, m^4, of
/// a cell's water at its centre.
struct WaterMoment {
  double volume = 0.0;
  Vec3 moment = Vec3::Zero();
};
WaterMoment water_moment(const Grid& grid, const Array3<double>& held);

/// Volume, momentum, energies and largest speed of the water, added to the report; `inside`: of what
/// cells hold. Momenta and kinetic energy are those of what cells hold, potential energy that of all
/// the water there is, with their residual [D65].
void add_water_statistics(const SimulationOptions& options, const WaterStep& water,
                          const WaterMoment& inside, const Coupling& coupling, StepReport& report);

/// Largest modal displacement of a surface vertex over the body's radius.
double deformation(const ReducedBody& body);

/// Largest |velocity| of a surface vertex, m/s.
double largest_surface_speed(const ReducedBody& body);
/// The same of each body, m/s.
std::vector<double> largest_surface_speeds(const std::vector<ReducedBody>& bodies);

/// Kinetic and elastic energy of all, J.
double energy_of_bodies(const std::vector<ReducedBody>& bodies);

}  // namespace archetide
