#pragma once

#include "runtime/pressure/pressure_system.h"

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

/// Of the water, in two measures of the mass of a face.
struct WaterMotion {
  Motion held;    // the mean of what both its cells hold, beside solids as `solved`
  Motion solved;  // as the pressure solve counts: rho dx^3 e between two unknowns, theta of it
                  // between an unknown and air

  WaterMotion& operator+=(const WaterMotion& other) {
    held += other.held, solved += other.solved;
    return *this;
  }
  WaterMotion operator-(const WaterMotion& other) const {
    return {held - other.held, solved - other.solved};
  }
};
/// Of the water at velocity u, face by face; `held`: water in each cell, dx^3 (null: both measures
/// are the solve's). By what cells hold a surface that passes a cell's centre is no jump of the
/// mass. Sums do not depend on the number of threads.
WaterMotion water_motion(const Grid& g, const PressureSystem& system, const Array3<double>* held,
                         const MacField& u);
/// Kinetic energy, J, that faces with valid == 1 lost when those faster than `most`, m/s, were
/// slowed down to it; in the measure of what cells hold.
double energy_above(const Grid& g, const PressureSystem& system, const Array3<double>& held,
                    const FaceField<unsigned char>& valid, double most, const MacField& u);

}  // namespace archetide
