#pragma once

#include "runtime/coupling/coupling.h"

namespace archetide {

/// A tank of still water without gravity, in which one body moves.
struct AddedMassTank {
  Grid grid;
  bool walls = false;        // closed sides; otherwise p' = 0 there
  double level = INFINITY;   // z of the free surface, m, where p' = 0; infinite: full
  double density = 1000.0;   // of the water, kg/m^3
  double tolerance = 1e-10;  // of the coupled solves, see CoupledSolveOptions
};

/// What the water around a body adds to its mass: the generalised impulse that an impulsive motion
/// with the velocities y asks of the body beyond its own is `matrix` y.
struct AddedMass {
  /// (6 + r) x (6 + r), for y = (v, w, q_dot) as in GeneralisedMass: kg (v, q_dot), kg m (v with w),
  /// kg m^2 (w).
  MatX matrix;
  double asymmetry = 0.0;  // largest |M_ij - M_ji| over sqrt(M_ii M_jj), of the solve; 1
  int iterations = 0;      // of all solves
};

/// The smallest grid of an even count of such cells (m) along each axis, its middle at 0, that holds a
/// tank of this size (m). Throws InputError.
Grid added_mass_grid(double cell, const Vec3& size);

/// The added mass of the body where it stands and as it is shaped, by one coupled solve for each of
/// its degrees of freedom (docs/method.md, B7); `body` needs stored modes or none, its velocities do
/// not count. Throws InputError if the body leaves the tank or no water meets it, NumericsError if a
/// solve does not converge or the water keeps a mode from moving at all.
AddedMass added_mass(const ReducedBody& body, const AddedMassTank& tank);

}  // namespace archetide
