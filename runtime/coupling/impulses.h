#pragma once

#include <vector>

#include "runtime/coupling/coupled_solve.h"

namespace archetide {

/// N s, and its moment about the origin of the world, N m s.
struct Impulse {
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();

  Impulse& operator+=(const Impulse& other) {
    P += other.P, L += other.L;
    return *this;
  }
  Impulse operator-(const Impulse& other) const { return {P - other.P, L - other.L}; }
};
/// One that acts at x, m.
inline Impulse impulse_at(const Vec3& x, const Vec3& P, const Vec3& about_x = Vec3::Zero()) {
  return {P, about_x + x.cross(P)};
}

/// What the pressure p' of a solve over h s gave the water, summed by parts over its faces: the
/// gain of momentum sum -(p'_high - p'_low) e is what each cell pushes where openings e differ on
/// its two sides (solids), and what p' of the free surface pushes. In the masses of the solve, e
/// and theta e.
struct PressureImpulses {
  Impulse solids;   // walls and obstacles: all solids less what the bodies' fluxes take
  Impulse bodies;   // what p' takes from the water for the bodies, at the cells where it acts
  Impulse surface;  // p' of the surface holds the weight of the water and its hydrostatic pressure
};
/// `phi`: the solve's pressure, dt p' / (rho dx) less its surface mean, m/s. Sums do not depend on
/// the number of threads.
PressureImpulses pressure_impulses(const Grid& g, const PressureSystem& system, double h,
                                   const Array3<double>& phi,
                                   const std::vector<CoupledBody>& bodies);

}  // namespace archetide
