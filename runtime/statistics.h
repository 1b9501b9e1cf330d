#pragma once

#include "runtime/simulation.h"

namespace archetide {

/// Momenta and energies of one body, added to the report.
void add_body_statistics(const ReducedBody& body, const Vec3& gravity, StepReport& report);

/// Volume, momentum, energies and largest speed of the water, added to the report; grid: of its
/// fields.
void add_water_statistics(const SimulationOptions& options, const Grid& grid,
                          const FluidState& fluid, const Coupling& coupling, StepReport& report);

/// Volume of the water that cells hold (dx^3), m^3, and its first moment about the origin, m^4, of
/// a cell's water at its centre.
struct WaterMoment {
  double volume = 0.0;
  Vec3 moment = Vec3::Zero();
};
WaterMoment water_moment(const Grid& grid, const Array3<double>& held);

/// Largest modal displacement of a surface vertex over the body's radius.
double deformation(const ReducedBody& body);

/// Largest |velocity| of a surface vertex, m/s.
double largest_surface_speed(const ReducedBody& body);

/// The first body that is not finite, or -1.
int broken_body(const std::vector<ReducedBody>& bodies);

/// Throws SimulationFailure naming the body and mode, or the cell, if anything is not finite.
void demand_finite(const std::vector<ReducedBody>& bodies, const FluidState& fluid,
                   const StepReport& report);

}  // namespace archetide
