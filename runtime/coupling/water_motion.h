#pragma once

#include "runtime/coupling/pressure_system.h"

namespace archetide {

/// Momentum, angular momentum about the origin of the world, and kinetic energy.
struct Motion {
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();  // N s, N m s
  double kinetic = 0.0;                     // J

  Motion& operator+=(const Motion& other) {
    P += other.P, L += other.L, kinetic += other.kinetic;
    return *this;
  }
  Motion operator-(const Motion& other) const {
    return {P - other.P, L - other.L, kinetic - other.kinetic};
  }
};

/// Of the water at velocity u, face by face. Beside solids in the masses that the pressure solve
/// gives them: rho dx^3 e between two unknowns, theta of it between an unknown and air. Elsewhere
/// with the mean of what both cells hold (`held`, dx^3; null: the masses of the solve there too): a
/// surface that passes a cell's centre is no jump of the mass. Sums do not depend on the number of
/// threads.
Motion water_motion(const Grid& g, const PressureSystem& system, const Array3<double>* held,
                    const MacField& u);

}  // namespace archetide
