#pragma once

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// How a body at rest answers a push at its lowest points, those that it would lie on or land on:
/// one force along `up`, spread over what looks down there. Linear, with its stored modes
/// (docs/method.md, S16). All zero for a rigid body.
struct SupportResponse {
  double mass = 0.0;         // m_s: what a push there has to move of the rigid body, kg
  double mobility = 0.0;     // c^T M_r^-1 c: what the modes add to 1 / m_s, 1/kg
  double compliance = 0.0;   // c^T K_r^-1 c: way of the points per force, m/N
  double deformation = 0.0;  // largest displacement of a surface point over the radius, 1/N
  double height = 0.0;       // of the body along up, over its radius, 1
  double area = 0.0;         // of the points, projected along up, m^2
};

/// `up`: unit vector, world, against gravity. O(vertices r + r^3).
SupportResponse support_response(const ReducedBody& body, const Vec3& up);

/// Mass of the water that a slam of these points sets in motion, kg (S18); `density`: of the water.
double slammed_water(const SupportResponse& support, double density);

/// Deformation of the body that lies there while `pull` (m/s^2) draws it down, 1 (S17).
double resting_deformation(const SupportResponse& support, double pull);

/// The largest deformation when its points hit a mass at rest (`struck`, kg; infinite: a floor) at
/// the speed v (m/s), 1 (S18).
double impact_deformation(const SupportResponse& support, double v, double struck);

}  // namespace archetide
